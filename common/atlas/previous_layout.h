// An earlier packing, so that what has not changed stays where it was.
#pragma once

#include <optional>

#include "common/atlas/atlas.h"
#include "common/pack/pack.h"

namespace kiln {

// Objects are told apart by names, not by numbers of nodes: a number changes when a node before it goes.
struct PreviousLayout {
  struct Object {
    std::string name;   // object_key
    uint64_t pose = 0;  // tells objects of one name apart
    std::vector<PackedChart> charts;
  };
  uint32_t width = 0, height = 0, pages = 0;
  std::vector<Object> objects;
};

// "node name/mesh name/primitive"; a node without a name goes by its number.
std::string object_key(const Scene& scene, size_t instance);

// Of an atlas of layout pack: what the next bake's AtlasSettings::previous wants.
PreviousLayout previous_layout_of(const Scene& scene, const Atlas& atlas);

// `keys`: by placement, as PackedChart::key. A chart has a previous place if an object of its name had a
// chart of its number and key. Objects of one name: first those that have not moved, then in order.
PreviousPlaces match_previous(const Scene& scene, const Atlas& atlas, const std::vector<uint64_t>& keys,
                              const PreviousLayout& previous);

}  // namespace kiln

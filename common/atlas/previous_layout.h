// An earlier packing, so that unchanged charts keep their place.
#pragma once

#include <optional>

#include "common/atlas/atlas.h"
#include "common/pack/pack.h"

namespace kiln {

// Objects are identified by name, not by node number: numbers shift when an earlier node is removed.
struct PreviousLayout {
  struct Object {
    std::string name;   // object_key
    uint64_t pose = 0;  // distinguishes objects of the same name
    std::vector<PackedChart> charts;
  };
  uint32_t width = 0, height = 0, pages = 0;
  std::vector<Object> objects;
};

// "node name/mesh name/primitive"; an unnamed node uses its number.
std::string object_key(const Scene& scene, size_t instance);

// Extracts AtlasSettings::previous for the next bake from an atlas of layout pack.
PreviousLayout previous_layout_of(const Scene& scene, const Atlas& atlas);

// `keys`: by placement, as PackedChart::key. A chart has a previous place if an object of its name had a
// chart of its number and key. Objects of one name: first those that have not moved, then in order.
PreviousPlaces match_previous(const Scene& scene, const Atlas& atlas, const std::vector<uint64_t>& keys,
                              const PreviousLayout& previous);

}  // namespace kiln

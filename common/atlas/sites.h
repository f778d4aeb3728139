// Texel sites: which of a texel's 64 points lie on which face.
#pragma once

#include "common/atlas/atlas.h"

namespace kiln {

// Points covered by more than one face; the first in (instance, face) order owns them.
struct SiteOverlap {
  uint64_t covered_points = 0, points = 0;
  uint64_t texels = 0;  // with more than bare contact: kContactPoints or more such points
  // The texel with most such points (the first of several), and a pair of faces there.
  uint32_t worst_texel = 0, worst_points = 0;
  uint32_t instance[2] = {}, face[2] = {};
};
constexpr uint32_t kContactPoints = 4;

// Fills atlas.sites, in order of texel, from charts and placements. Error: more words than can be indexed.
Expected<SiteOverlap> find_sites(Atlas& atlas, unsigned threads);

// Indices of the positions in Morton order, so that neighbours in the list are near each other; ties by
// index.
std::vector<uint32_t> morton_order(const std::vector<Vec3>& positions, unsigned threads);

// Puts atlas.sites into Morton order of the world position of each texel's first point; ties by texel.
void order_sites(const Scene& scene, Atlas& atlas, unsigned threads);

}  // namespace kiln

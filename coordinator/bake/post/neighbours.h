#pragma once

#include <cstdint>

#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Calls visit(index) for the up to 8 neighbours of a texel on its own page.
template <class Visit>
void for_each_neighbour(const Lightmap& map, size_t texel, const Visit& visit) {
  const int width = static_cast<int>(map.planes.width), height = static_cast<int>(map.page_height);
  const int x = static_cast<int>(texel % map.planes.width);
  const int row = static_cast<int>(texel / map.planes.width), page = row / height, y = row % height;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int nx = x + dx, ny = y + dy;
      if ((dx == 0 && dy == 0) || nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
      visit((static_cast<size_t>(page) * height + ny) * width + nx);
    }
}

// Fills one ring: every texel of `open` with neighbours that are set and accepted gets their mean in all
// planes but "samples", and the class `made`. Reads only texels set before the call, so order does not
// matter. Returns the texels still open.
template <class Accept>
std::vector<uint32_t> fill_ring(Lightmap& map, const std::vector<uint32_t>& open, Validity made,
                                const Accept& accept) {
  const std::vector<float>* const samples = &map.planes.plane("samples");
  std::vector<uint32_t> left, done;
  for (const uint32_t texel : open) {
    std::vector<size_t> from;
    for_each_neighbour(map, texel, [&](size_t n) {
      if (is_set(map.validity[n]) && accept(texel, n)) from.push_back(n);
    });
    if (from.empty()) {
      left.push_back(texel);
      continue;
    }
    done.push_back(texel);
    for (std::vector<float>& plane : map.planes.data) {
      if (&plane == samples) continue;
      double sum = 0;
      for (size_t n : from) sum += plane[n];
      plane[texel] = static_cast<float>(sum / static_cast<double>(from.size()));
    }
  }
  for (const uint32_t texel : done) map.validity[texel] = made;
  return left;
}

}  // namespace kiln

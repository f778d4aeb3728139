#include "coordinator/post/neighbours.h"
#include "coordinator/post/stage.h"

namespace kiln {

Figures fill_invalid(Lightmap& map, const PostContext& context) {
  const Atlas& atlas = context.atlas;
  std::vector<uint32_t> open;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t] != 0 && !is_set(map.validity[t])) open.push_back(static_cast<uint32_t>(t));
  while (!open.empty()) {
    const size_t before = open.size();
    open = fill_ring(map, open, Validity::kFilled,
                     [&](size_t a, size_t b) { return atlas.owner[a] == atlas.owner[b]; });
    if (open.size() == before) break;
  }
  // What saw only the inside of geometry and has no neighbour stays black: its radiance means nothing.
  for (const uint32_t t : open)
    for (std::vector<float>& plane : map.planes.data) plane[t] = 0.0f;
  return {};
}

}  // namespace kiln

#include "coordinator/post/neighbours.h"
#include "coordinator/post/stage.h"

namespace kiln {

Figures fill_invalid(Lightmap& map, const PostContext& context) {
  const Atlas& atlas = context.atlas;
  const auto same_chart = [&](size_t a, size_t b) { return atlas.owner[a] == atlas.owner[b]; };
  // A texel whose sites are all inside geometry and were pushed out of it may have come out on the far side:
  // where a texel beside it is measured, that one knows better.
  std::vector<uint32_t> pushed;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kPushed) pushed.push_back(static_cast<uint32_t>(t));
  fill_ring(map, pushed, Validity::kFilled,
            [&](size_t a, size_t b) { return same_chart(a, b) && map.validity[b] == Validity::kMeasured; });
  std::vector<uint32_t> open;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t] != 0 && !is_set(map.validity[t])) open.push_back(static_cast<uint32_t>(t));
  while (!open.empty()) {
    const size_t before = open.size();
    open = fill_ring(map, open, Validity::kFilled, same_chart);
    if (open.size() == before) break;
  }
  // What saw only the inside of geometry and has no neighbour stays black: its radiance means nothing.
  for (const uint32_t t : open)
    for (std::vector<float>& plane : map.planes.data) plane[t] = 0.0f;
  return {};
}

}  // namespace kiln

#include "coordinator/bake/post/neighbours.h"
#include "coordinator/bake/post/stage.h"

namespace kiln {

Figures dilate(Lightmap& map, const PostContext& context) {
  std::vector<uint32_t> open;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kEmpty && context.atlas.owner[t] == 0)
      open.push_back(static_cast<uint32_t>(t));
  for (uint32_t ring = 0; ring < context.settings.dilate && !open.empty(); ++ring)
    open = fill_ring(map, open, Validity::kDilated, [](size_t, size_t) { return true; });
  return {};
}

}  // namespace kiln

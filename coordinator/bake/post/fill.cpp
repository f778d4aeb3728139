#include "coordinator/bake/post/across.h"
#include "coordinator/bake/post/neighbours.h"
#include "coordinator/bake/post/stage.h"

namespace kiln {
namespace {

// A texel whose sites are all inside geometry may have been pushed out on the far side: an adjacent measured
// texel is more reliable.
template <class SameChart>
void correct_pushed(Lightmap& map, const SameChart& same_chart) {
  std::vector<uint32_t> pushed;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (map.validity[t] == Validity::kPushed) pushed.push_back(static_cast<uint32_t>(t));
  fill_ring(map, pushed, Validity::kFilled,
            [&](size_t a, size_t b) { return same_chart(a, b) && map.validity[b] == Validity::kMeasured; });
}

// Unset texels of charts, minus those that could be filled.
template <class SameChart>
std::vector<uint32_t> fill_rings(Lightmap& map, const Atlas& atlas, const SameChart& same_chart) {
  std::vector<uint32_t> open;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t] != 0 && !is_set(map.validity[t])) open.push_back(static_cast<uint32_t>(t));
  while (!open.empty()) {
    const size_t before = open.size();
    open = fill_ring(map, open, Validity::kFilled, same_chart);
    if (open.size() == before) break;
  }
  return open;
}

}  // namespace

Figures fill_invalid(Lightmap& map, const PostContext& context) {
  constexpr int kMaxSeams = 8;  // between a chart without a value and one that has some
  const Atlas& atlas = context.atlas;
  const auto same_chart = [&](size_t a, size_t b) { return atlas.owner[a] == atlas.owner[b]; };
  SeamFinder own(context.scene, atlas);
  SeamFinder& seams = context.seams ? *context.seams : own;
  correct_pushed(map, same_chart);
  std::vector<uint32_t> open = fill_rings(map, atlas, same_chart);
  const size_t alone = open.size();
  for (int k = 0; k < kMaxSeams && !open.empty() && fill_across_seams(map, seams); ++k)
    open = fill_rings(map, atlas, same_chart);
  // Texels that saw only back faces or nothing, without a better neighbour, stay black.
  for (const uint32_t t : open)
    for (std::vector<float>& plane : map.planes.data) plane[t] = 0.0f;
  if (alone == 0) return {};
  return {{"texels of charts without a measured one", static_cast<double>(alone), "texels"},
          {"of these black: no surface goes on from them", static_cast<double>(open.size()), "texels"}};
}

}  // namespace kiln

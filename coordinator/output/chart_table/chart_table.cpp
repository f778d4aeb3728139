#include "coordinator/output/chart_table/chart_table.h"

#include "common/base/check.h"

namespace kiln {

Vec2 ChartBounds::to_box(const Vec2& uv) const {
  const DVec2 extent = high - low;
  Vec2 out(0.0f);
  for (int k = 0; k < 2; ++k)
    if (extent[k] > 0) out[k] = static_cast<float>((uv[k] - low[k]) / extent[k]);
  return out;
}

std::vector<ChartBounds> chart_bounds(const MeshCharts& charts) {
  std::vector<ChartBounds> bounds(charts.chart_count);
  std::vector<bool> begun(charts.chart_count);
  for (size_t corner = 0; corner < charts.corner_uv.size(); ++corner) {
    const uint32_t chart = charts.chart_of_face[corner / 3];
    const DVec2 uv(charts.corner_uv[corner]);
    ChartBounds& b = bounds[chart];
    if (!begun[chart]) b = {uv, uv};
    begun[chart] = true;
    for (int k = 0; k < 2; ++k) {
      b.low[k] = std::min(b.low[k], uv[k]);
      b.high[k] = std::max(b.high[k], uv[k]);
    }
  }
  return bounds;
}

std::vector<ChartTransform> chart_transforms(const Atlas& atlas) {
  KILN_CHECK(atlas.packed);
  std::vector<std::vector<ChartBounds>> bounds;
  for (const MeshCharts& charts : atlas.charts) bounds.push_back(chart_bounds(charts));
  std::vector<ChartTransform> out;
  out.reserve(atlas.placements.size());
  const DVec2 size(atlas.width, atlas.height);
  for (size_t i = 0; i < atlas.charts_of_instance.size(); ++i)
    for (const ChartBounds& b : bounds[atlas.charts_of_instance[i]]) {
      const ChartPlacement& place = atlas.placements[out.size()];
      const DVec2 extent = b.high - b.low;
      const DVec2 along = place.turned ? DVec2(extent.y, extent.x) : extent;
      // In double: the box's corner may be far from 0, where a float has no texel precision.
      out.push_back({Vec2(along * DVec2(place.scale) / size), Vec2(place.to_texels(b.low) / size), place.page,
                     place.turned});
    }
  KILN_CHECK(out.size() == atlas.placements.size());
  return out;
}

}  // namespace kiln

#include "common/atlas/site_picker.h"

#include <bit>

#include "common/raster/site_points.h"

namespace kiln {

Vec2 site_point(uint32_t j) {
  return Vec2(DVec2(kSitePoints.x[j & 63], kSitePoints.y[j & 63]));
}

SitePicker::SitePicker(const Atlas& atlas, uint32_t site)
    : atlas_(atlas), pairs_(atlas.sites.words.data() + atlas.sites.first_word[site] + 2) {
  const uint32_t texel = atlas.sites.texel[site] % (atlas.width * atlas.height);
  x_ = texel % atlas.width;
  y_ = texel / atlas.width;
  uint64_t valid = pairs_[-2] | uint64_t{pairs_[-1]} << 32;
  for (; valid; valid &= valid - 1) points_[count_++] = static_cast<uint8_t>(std::countr_zero(valid));
}

void SitePicker::enter(const uint32_t* pair) {
  const uint32_t instance = pair[2], face = pair[3];
  const MeshCharts& charts = atlas_.of_instance(instance);
  const ChartPlacement& place =
      atlas_.placements[atlas_.instance_first_chart[instance] + charts.chart_of_face[face]];
  corners_ = texel_triangle(charts, place, face);
  triangle_ = charts.triangle_of(face);
  part_ = charts.parts.empty() ? nullptr : &charts.parts[face];
  whole_ = area2(corners_);
  entered_ = pair;
}

SitePick SitePicker::at(uint32_t index) {
  const uint32_t j = points_[index];
  const uint32_t* pair = pairs_;
  while (!((pair[0] | uint64_t{pair[1]} << 32) >> j & 1)) pair += 4;
  if (pair != entered_) enter(pair);
  SitePick pick{pair[2], triangle_, 0, 0};
  double b1 = 1.0 / 3, b2 = 1.0 / 3;
  if (whole_ != 0) {
    const Vec2 point = site_point(j);
    const DVec2 p(x_ + double{point.x}, y_ + double{point.y});
    b1 = std::clamp(area2(corners_.c[2], corners_.c[0], p) / whole_, 0.0, 1.0);
    b2 = std::clamp(area2(corners_.c[0], corners_.c[1], p) / whole_, 0.0, 1.0);
    if (b1 + b2 > 1) {
      const double sum = b1 + b2;
      b1 /= sum;
      b2 /= sum;
    }
  }
  if (part_) {
    const DVec2 c0(part_->corner[0]), c1(part_->corner[1]), c2(part_->corner[2]);
    const DVec2 b = c0 + b1 * (c1 - c0) + b2 * (c2 - c0);
    b1 = b.x;
    b2 = b.y;
  }
  pick.b1 = static_cast<float>(b1);
  pick.b2 = static_cast<float>(b2);
  return pick;
}

SitePick pick_site(const Atlas& atlas, uint32_t site, float u) {
  return SitePicker(atlas, site).pick(u);
}

}  // namespace kiln

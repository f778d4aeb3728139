#include "common/raster/coverage.h"

#include "common/raster/site_points.h"

namespace kiln {
HalfPlane::HalfPlane(const DVec2& from, const DVec2& to, bool positive) : origin_(from), positive_(positive) {
  DVec2 end = to;
  if (end.x < origin_.x || (end.x == origin_.x && end.y < origin_.y)) {
    std::swap(origin_, end);
    positive_ = !positive_;
  }
  d_ = end - origin_;
  least_ = std::min(0.0, d_.x) + std::min(0.0, -d_.y);
  most_ = std::max(0.0, d_.x) + std::max(0.0, -d_.y);
  // A ten-millionth of a texel, far above rounding: the early outs below never contradict the point tests.
  margin_ = 1e-7 * (std::abs(d_.x) + std::abs(d_.y));
}

uint64_t HalfPlane::mask(double x, double y) const {
  const double corner = d_.x * (y - origin_.y) - d_.y * (x - origin_.x);
  if (corner + least_ > margin_) return positive_ ? ~uint64_t{0} : 0;
  if (corner + most_ < -margin_) return positive_ ? 0 : ~uint64_t{0};
  uint64_t on_positive_side = 0;
  for (int j = 0; j < 64; ++j)
    on_positive_side |= uint64_t{corner + (d_.x * kSitePoints.y[j] - d_.y * kSitePoints.x[j]) >= 0} << j;
  return positive_ ? on_positive_side : ~on_positive_side;
}

CoverageTest::CoverageTest(const Triangle2& t)
    : sides{HalfPlane(t.c[0], t.c[1], area2(t) > 0), HalfPlane(t.c[1], t.c[2], area2(t) > 0),
            HalfPlane(t.c[2], t.c[0], area2(t) > 0)} {}

}  // namespace kiln

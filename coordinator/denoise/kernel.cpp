#include "coordinator/denoise/kernel.h"

#include "common/math/frame.h"

namespace kiln {
namespace {

// Of the covariance, relative to the square of the bandwidth: what is in one row has no slope across it.
constexpr double kLeastSpread = 1e-6;

}  // namespace

void SurfaceKernel::enter(uint32_t site, float texels) {
  const Vec3 centre = sites_.position[site], normal = sites_.normal[site];
  size_ = sites_.texel_size[site];
  const Frame frame(normal);
  count_ = 0;
  for (const uint32_t other : window_.around(site, texels * sites_.texel_size[site])) {
    if (!known_[other]) continue;
    const Vec3 d = sites_.position[other] - centre;
    site_[count_] = other;
    x_[count_] = dot(d, frame.x);
    y_[count_] = dot(d, frame.y);
    square_[count_] = dot(d, d);
    // Ward 1988 weighs by the angle of the normals too; here it falls to 0 at the window's largest.
    const float agreement =
        (dot(sites_.normal[other], normal) - SurfaceWindow::kLeastCosine) / (1 - SurfaceWindow::kLeastCosine);
    agreement_[count_] = count_ == 0 ? 1.0 : std::clamp(double{agreement}, 0.0, 1.0);
    ++count_;
  }
}

void SurfaceKernel::regression(float texels, Weights& out) const {
  const double h = texels * size_, inverse = h > 0 ? 1 / h : 0;
  double sum = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (size_t i = 0; i < count_; ++i) {
    const double w = i == 0 ? 1.0 : falloff(i, texels), x = x_[i] * inverse, y = y_[i] * inverse;
    out[i] = w;
    sum += w;
    sx += w * x, sy += w * y;
    sxx += w * x * x, sxy += w * x * y, syy += w * y * y;
  }
  const double mx = sx / sum, my = sy / sum;
  const double xx = sxx / sum - mx * mx + kLeastSpread, yy = syy / sum - my * my + kLeastSpread;
  const double xy = sxy / sum - mx * my, det = xx * yy - xy * xy;
  const double gx = (my * xy - mx * yy) / det, gy = (mx * xy - my * xx) / det;
  for (size_t i = 0; i < count_; ++i)
    out[i] *= (1 + gx * (x_[i] * inverse - mx) + gy * (y_[i] * inverse - my)) / sum;
}

}  // namespace kiln

// Local linear regression over the sites around a site.
#pragma once

#include <array>

#include "coordinator/neighbours/surface_window.h"

namespace kiln {

// Bandwidths of the filters in texels of the site; level 0 is no filter. A doubling each: the variance falls
// by four. Measured: 1 texel more or less at the top changes the mean error by 10 %.
constexpr uint32_t kLevels = 4;
constexpr std::array<float, kLevels> kBandwidth = {0.0f, 1.6f, 3.2f, 6.4f};

// The window of a site in coordinates of its tangent plane, and the weights of each filter over it.
class SurfaceKernel {
 public:
  using Weights = std::array<double, SurfaceWindow::kMost>;

  // `known`: sites that take part, by site; all outlive the kernel.
  SurfaceKernel(const SiteGeometry& sites, const SurfaceLinks& links, std::span<const uint8_t> known)
      : sites_(sites), known_(known), window_(sites, links) {}

  // Looks up to `texels` texels far around a known site. Sites that are not known are left out.
  void enter(uint32_t site, float texels);
  std::span<const uint32_t> window() const { return {site_.data(), count_}; }  // the site itself first

  // Weights of the regression's value at the site with bandwidth `texels`, adding to 1; linear fields keep
  // their value. Beside a border some are below 0.
  void regression(float texels, Weights& out) const;
  // Positive, 1 at the site, falling to 0 at `texels`: of means of squares.
  double falloff(size_t index, float texels) const {
    const double reach = double{texels} * size_;
    return std::max(0.0, 1 - square_[index] / (reach * reach)) * agreement_[index];
  }

 private:
  const SiteGeometry& sites_;
  std::span<const uint8_t> known_;
  SurfaceWindow window_;
  double size_ = 0;  // metres a texel measures
  size_t count_ = 0;
  std::array<uint32_t, SurfaceWindow::kMost> site_{};
  std::array<double, SurfaceWindow::kMost> x_{}, y_{}, square_{}, agreement_{};
};

}  // namespace kiln

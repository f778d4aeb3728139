// Local regression over the sites around a site.
#pragma once

#include <algorithm>
#include <array>

#include "coordinator/bake/neighbours/kept_windows.h"
#include "coordinator/bake/neighbours/regular_windows.h"
#include "coordinator/bake/neighbours/surface_window.h"

namespace kiln {

// Level 0 does not filter; the next levels fit planes over windows of these radii in texels of the site, each
// twice the last (a quarter of the variance); the last fits a quadratic surface over the widest window.
constexpr uint32_t kLevels = 5;
constexpr uint32_t kQuadratic = kLevels - 1;
constexpr std::array<float, kLevels> kBandwidth = {0.0f, 1.6f, 3.2f, 6.4f, 6.4f};

// What is known of the windows of some sites and links, so that they need not be walked to; null: nothing.
struct WindowTables {
  KeptWindows* kept = nullptr;  // the widest windows
  const RegularWindows* regular = nullptr;
};

// The window of a site in coordinates of its tangent plane, and the weights of each filter over it.
class SurfaceKernel {
 public:
  static constexpr size_t kRings = 3;  // as wide as levels 1, 2 and all above
  using Weights = std::array<double, SurfaceWindow::kMax>;

  // `known`: sites that take part, by site. All outlive the kernel.
  SurfaceKernel(const SiteGeometry& sites, const SurfaceLinks& links, std::span<const uint8_t> known,
                WindowTables tables)
      : sites_(sites), known_(known), window_(sites, links), tables_(tables) {}

  // Builds the window up to `texels` texels around a site. Unknown sites are skipped; only a known site has
  // weights.
  void enter(uint32_t site, float texels);
  std::span<const uint32_t> window() const {
    return {site_.data(), count_};
  }  // the site first, then by distance ring
  // The sites of that window, unknown ones too, without entering it.
  std::span<const uint32_t> sites_within(uint32_t site, float texels);

  // Weights that give the fit of level > 0 at the site. They sum to 1 and reproduce linear fields
  // (kQuadratic: quadratic ones); some are negative. They cover the first sites of the window; later sites
  // have no weight.
  size_t regression(uint32_t level, Weights& out) const {
    const size_t count = end_[std::min<size_t>(level, kRings) - 1];
    if (is_regular_) {
      std::copy_n(regular_weights()[level].begin(), count, out.begin());
      return count;
    }
    level == kQuadratic ? quadratic(kBandwidth[level], count, out) : linear(kBandwidth[level], count, out);
    return count;
  }
  // Weights for means of squares: positive, 1 at the site, falling to 0 at `texels`.
  double falloff(size_t index, float texels) const {
    const double reach = double{texels} * size_;
    return std::max(0.0, 1 - square_[index] * (1 / (reach * reach))) * agreement_[index];
  }

 private:
  std::span<const uint32_t> around(uint32_t site, float texels);
  bool enter_regular(uint32_t site, float texels);
  void take_shape();
  static const std::array<Weights, kLevels>& regular_weights();  // by level, of RegularWindows::shape()
  void linear(float texels, size_t count, Weights& out) const;
  void quadratic(float texels, size_t count, Weights& out) const;

  const SiteGeometry& sites_;
  std::span<const uint8_t> known_;
  SurfaceWindow window_;
  const WindowTables tables_;
  bool is_regular_ = false;  // the present window is
  std::array<uint32_t, SurfaceWindow::kMax> around_{};
  double size_ = 0;  // metres a texel measures
  size_t count_ = 0;
  std::array<size_t, kRings> end_{};  // of rings in the window
  std::array<uint32_t, SurfaceWindow::kMax> site_{};
  std::array<double, SurfaceWindow::kMax> x_{}, y_{}, square_{}, agreement_{};
};

}  // namespace kiln

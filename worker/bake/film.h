// Sums of one texel over a range of samples, laid out as MomentLayout says. Linear moments only, in double,
// in sample order: they merge by addition, and a bit of float noise at 10^6 samples stays far below the
// reported error.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/job/unit.h"
#include "worker/integrators/integrator.h"

namespace kiln {

class Film {
 public:
  // `layout` belongs to the job with these settings and outlives the film.
  Film(const MomentLayout& layout, const ResponseSettings& settings)
      : layout_(&layout), settings_(&settings), basis_(layout.basis()), functions_(layout.functions()) {
    sums_.resize(layout.planes());
  }
  void clear() { std::fill(sums_.begin(), sums_.end(), 0.0); }

  // Adds one sample. Returns false if a contribution was not finite; that one is dropped, the others count.
  bool add(const RadianceSamples& radiance, const Vec3& normal) {
    if (radiance.inside) sums_[kMomentInside] += 1.0;
    const std::vector<uint32_t>& responses = layout_->quantities().responses;
    for (size_t k = 0; k < responses.size(); ++k)
      Responses::accumulate(responses[k], radiance.primary, *settings_, &sums_[layout_->response(k)]);
    return layout_->has_light() ? add_light(radiance, normal) : true;
  }
  void count_pushed() { sums_[kMomentPushed] += 1.0; }
  const std::vector<double>& sums() const { return sums_; }

 private:
  bool add_light(const RadianceSamples& radiance, const Vec3& normal) {
    bool finite = true;
    Vec3 e(0.0f), direct(0.0f), hidden(0.0f);
    for (int i = 0; i < radiance.count; ++i) {
      const Vec3& d = radiance.items[i].direction;
      const Vec3& c = radiance.items[i].contribution;
      const Arriving how = radiance.items[i].how;
      Vec3& sum = how == Arriving::kHidden ? hidden : how == Arriving::kDirectShare ? direct : e;
      const Vec3 added = c * std::max(0.0f, dot(d, normal)), with = sum + added;
      if (!is_finite(with)) {  // implied if c is not finite
        finite = false;
        continue;
      }
      sum = with;
      if (how == Arriving::kHidden || how == Arriving::kDirectShare) continue;
      if (how == Arriving::kDirect) direct += added;
      float f[kMaxBasisFunctions];
      evaluate_basis(basis_, d, normal, f);
      for (size_t k = 0; k < functions_; ++k)
        for (int channel = 0; channel < 3; ++channel)
          sums_[kMomentBasis + 3 * k + channel] += double{f[k]} * double{c[channel]};
    }
    const double lum = luminance(e);
    sums_[kMomentER] += e.x;
    sums_[kMomentEG] += e.y;
    sums_[kMomentEB] += e.z;
    sums_[kMomentLum] += lum;
    sums_[kMomentLum2] += lum * lum;
    if (layout_->quantities().direct_apart) add_to(layout_->direct(), direct);
    if (layout_->quantities().all_light) {
      const Vec3 all = e + hidden;
      finite &= is_finite(all);
      if (is_finite(all)) add_to(layout_->all_light(), all);
    }
    if (layout_->quantities().cache_draws) {
      const float cos = std::max(0.0f, dot(radiance.drawn_direction, normal));
      for (size_t k = 0; k < kCacheDraws; ++k) {
        const float drawn = radiance.drawn[k] * cos;
        if (std::isfinite(drawn)) sums_[layout_->cache_draws() + k] += double{drawn};
      }
    }
    return finite;
  }

  void add_to(size_t plane, const Vec3& e) {
    for (int channel = 0; channel < 3; ++channel)
      sums_[plane + static_cast<size_t>(channel)] += double{e[channel]};
  }

  const MomentLayout* layout_;
  const ResponseSettings* settings_;
  uint32_t basis_;
  size_t functions_;
  std::vector<double> sums_;
};

}  // namespace kiln

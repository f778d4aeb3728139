// Sums of one texel over a range of samples. Linear moments only, in double, in sample order: they merge
// by addition, and a bit of float noise at 10^6 samples stays far below the stated error.
#pragma once

#include <array>

#include "common/responses/basis.h"
#include "worker/integrators/integrator.h"

namespace kiln {

class Film {
 public:
  static constexpr size_t kMaxPlanes = kMomentBasis + 3 * kMaxBasisFunctions;

  explicit Film(uint32_t basis) : basis_(basis), functions_(basis_roster()[basis].functions.size()) {}
  size_t planes() const { return kMomentBasis + 3 * functions_; }
  void clear() { sums_.fill(0.0); }

  // Adds one sample. Returns false if a contribution was not finite: it is dropped, the others count.
  bool add(const RadianceSamples& radiance, const Vec3& normal) {
    bool finite = true;
    Vec3 e(0.0f);
    if (radiance.inside) sums_[kMomentInside] += 1.0;
    for (int i = 0; i < radiance.count; ++i) {
      const Vec3& d = radiance.items[i].direction;
      const Vec3& c = radiance.items[i].contribution;
      const Vec3 with = e + c * std::max(0.0f, dot(d, normal));
      if (!is_finite(with)) {  // nor is it if c is not
        finite = false;
        continue;
      }
      e = with;
      float f[kMaxBasisFunctions];
      evaluate_basis(basis_, d, f);
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
    return finite;
  }
  void count_pushed() { sums_[kMomentPushed] += 1.0; }
  const std::array<double, kMaxPlanes>& sums() const { return sums_; }

 private:
  uint32_t basis_;
  size_t functions_;
  std::array<double, kMaxPlanes> sums_{};
};

}  // namespace kiln

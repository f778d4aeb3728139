// Sums of one probe: light and distances from the whole sphere, laid out as MomentLayout says for probes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/job/unit.h"
#include "common/probes/octahedral.h"
#include "common/responses/sh_l2.h"
#include "worker/integrators/integrator.h"

namespace kiln {

// A sample covers half of the sphere, so its light counts twice. Two samples that follow each other cover
// both halves (sequence.h), and their mean tells the noise of the light rather than that of which half had a
// lamp. So squares are of means of pairs; ranges of samples begin and end between pairs.
class ProbeFilm {
 public:
  ProbeFilm(const MomentLayout& layout, const ResponseSettings&) : layout_(&layout) {
    sums_.resize(layout.planes());
  }
  void set_reach(float reach) { reach_ = reach; }
  void clear() {
    std::fill(sums_.begin(), sums_.end(), 0.0);
    is_second_ = false;
  }

  // Adds one sample. Returns false if a contribution was not finite; that one is dropped, the others count.
  bool add(const RadianceSamples& radiance, const Vec3&) {
    if (radiance.inside) sums_[kMomentInside] += 1.0;
    bool finite = true;
    Coefficients of_sample{};
    for (int i = 0; i < radiance.count; ++i) {
      const Vec3 c = 2.0f * radiance.items[i].contribution;
      finite &= is_finite(c);
      if (is_finite(c)) add_light(radiance.items[i].direction, c, of_sample);
    }
    const double lum = of_sample[0];
    sums_[kMomentLum] += lum;
    sums_[kMomentLum2] += lum * lum;
    add_pair(of_sample);
    if (layout_->quantities().probe_visibility) add_distance(radiance.primary);
    return finite;
  }
  void count_pushed() { sums_[kMomentPushed] += 1.0; }
  const std::vector<double>& sums() const { return sums_; }

 private:
  static constexpr size_t kFunctions = ShL2::functions.size();
  using Coefficients = std::array<double, kFunctions>;  // luminances

  void add_light(const Vec3& d, const Vec3& c, Coefficients& of_sample) {
    float f[kFunctions];
    ShL2::evaluate(d, d, f);
    for (int channel = 0; channel < 3; ++channel)
      sums_[kMomentER + static_cast<size_t>(channel)] += double{f[0]} * double{c[channel]};
    const double lum = luminance(c);
    for (size_t k = 0; k < kFunctions; ++k) {
      of_sample[k] += f[k] * lum;
      for (int channel = 0; channel < 3; ++channel)
        sums_[kMomentBasis + 3 * k + static_cast<size_t>(channel)] += double{f[k]} * double{c[channel]};
    }
    if (layout_->quantities().probe_visibility) add_octahedral(d, c);
  }

  void add_pair(const Coefficients& of_sample) {
    if (is_second_)
      for (size_t k = 0; k < kFunctions; ++k) {
        const double mean = 0.5 * (first_[k] + of_sample[k]);
        sums_[layout_->pair_squares() + k] += mean * mean;
      }
    first_ = of_sample;
    is_second_ = !is_second_;
  }

  // E of the texels' directions: no division by weights is needed, as the density of directions is known.
  void add_octahedral(const Vec3& d, const Vec3& c) {
    double* sums = &sums_[layout_->octahedral()];
    for (const Vec3& n : texels_of<kIrradianceSide>()) {
      if (const float cosine = dot(d, n); cosine > 0.0f)
        for (int channel = 0; channel < 3; ++channel) sums[channel] += double{cosine * c[channel]};
      sums += 3;
    }
  }

  // Weights are cos^50, and 0 below 1/1000. (Majercik et al. 2019; the exponent is that of its later code.)
  void add_distance(const PrimaryRay& ray) {
    constexpr float kLeastCosine = 0.870964f;  // 0.001^(1/50)
    const double distance = std::min(ray.distance, reach_);
    double* sums = &sums_[layout_->distances()];
    for (const Vec3& n : texels_of<kDistanceSide>()) {
      if (const float cosine = dot(ray.direction, n); cosine >= kLeastCosine) {
        const double c2 = double{cosine} * cosine, c4 = c2 * c2, c8 = c4 * c4, c16 = c8 * c8;
        const double weight = c16 * c16 * c16 * c2;
        sums[0] += weight;
        sums[1] += weight * distance;
        sums[2] += weight * distance * distance;
      }
      sums += 3;
    }
  }

  template <uint32_t kSide>
  static const std::array<Vec3, kSide * kSide>& texels_of() {
    static const auto kDirections = [] {
      std::array<Vec3, kSide * kSide> out;
      for (uint32_t t = 0; t < kSide * kSide; ++t) out[t] = octahedral_texel(t % kSide, t / kSide, kSide);
      return out;
    }();
    return kDirections;
  }

  const MomentLayout* layout_;
  float reach_ = 0;
  std::vector<double> sums_;
  Coefficients first_{};  // of the pair's first sample
  bool is_second_ = false;
};

}  // namespace kiln

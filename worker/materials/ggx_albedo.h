// What the GGX layer of ggx.h reflects of light from everywhere (its directional albedo, single scattering),
// from tables that are integrated when the first is asked for.
#pragma once

#include <array>

#include "worker/materials/ggx.h"
#include "worker/materials/sheen.h"

namespace kiln {

// Any quantity that is linear in Schlick's f0 and f90.
struct ByFresnel {
  float f0 = 0.0f, f90 = 0.0f;  // factors
  float of(float r0, float r90) const { return r0 * f0 + r90 * f90; }
  float white() const { return f0 + f90; }  // of a layer that reflects everything
};
inline ByFresnel operator*(const ByFresnel& a, float s) {
  return {a.f0 * s, a.f90 * s};
}
inline ByFresnel operator+(const ByFresnel& a, const ByFresnel& b) {
  return {a.f0 + b.f0, a.f90 + b.f90};
}

// The albedo of one width. Bilinear in the root of the cosine and the fourth root of alpha; at most 0.0012
// from the integral where the cosine is above 0.03 (tests/materials/ggx_albedo_test.cpp), and means are those
// of the interpolant, so that a lobe built from both has exactly the albedo it is meant to have.
class GgxAlbedo {
 public:
  static constexpr int kColumns = 40, kRows = 32;  // cells along the cosine and along alpha

  // What light of one direction, or light weighted by the cosine, meets.
  struct Terms {
    ByFresnel albedo;  // E
    ByFresnel fifth;   // K: the same integral with (1 - cos)^5 of the other direction under it
  };
  struct Means {
    Terms plain;        // 2 int E cos dcos, and of K
    Terms under_fifth;  // the same with (1 - cos)^5 under the integral
  };

  GgxAlbedo() = default;
  explicit GgxAlbedo(float alpha);  // [kLeastAlpha, 1]
  ByFresnel albedo(float cos) const { return at(cos, 0); }
  ByFresnel fifth(float cos) const { return at(cos, 1); }
  Means means() const;
  // The same with the albedo of a sheen layer under the integrals.
  Means means_under(const SheenAlbedo& sheen) const;

 private:
  using Row = std::array<ByFresnel, kColumns + 1>;
  struct Tables {
    Tables();
    Row rows[2][kRows + 1];  // E and K, by alpha
    Means means[kRows + 1];
  };
  using MeansUnderSheen = std::array<std::array<Means, kRows + 1>, SheenAlbedo::kRows + 1>;
  template <class F>
  static Means means_of(const Row& albedo, const Row& fifth, const F& weight);
  static const Tables& tables();
  static const MeansUnderSheen& means_under_sheen();  // integrated when a scene has its first sheen
  ByFresnel at(float cos, int table) const;

  const Tables* tables_ = nullptr;
  int row_ = 0;
  float blend_ = 0.0f;
};

inline ByFresnel GgxAlbedo::at(float cos, int table) const {
  const float t = std::sqrt(std::clamp(cos, 0.0f, 1.0f)) * kColumns;
  const int c = std::min(static_cast<int>(t), kColumns - 1);
  const float x = t - static_cast<float>(c);
  const Row& low = tables_->rows[table][row_];
  const Row& high = tables_->rows[table][row_ + 1];
  return (low[c] * (1.0f - x) + low[c + 1] * x) * (1.0f - blend_) +
         (high[c] * (1.0f - x) + high[c + 1] * x) * blend_;
}

}  // namespace kiln

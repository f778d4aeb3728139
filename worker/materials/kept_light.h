// What the layers of a closure leave to the lobes below them.
#pragma once

#include "worker/materials/ggx_albedo.h"

namespace kiln {

struct Bsdf;

// The shares of light, by its cosine to the normal, that the GGX layer, sheen and coat leave to the lobes
// below: to the Lambert layer, and to light that goes on between the facets of metal. Reciprocal lobes
// follow:
//   kept(o) kept(i) / (pi mean kept)   reflects kept(o) of even light (Kelemen & Szirmay-Kalos 2001)
class KeptLight {
 public:
  struct Shares {
    float under, metal;
  };
  KeptLight() = default;
  explicit KeptLight(const Bsdf& bsdf);
  Shares at(float cos) const {
    return is_covered() ? under_cover(cos) : rest(1.0f, 0.0f, layer_ ? base_.albedo(cos) : ByFresnel{});
  }
  // The same where the GGX layer's albedo at that cosine is known.
  Shares at(float cos, const ByFresnel& base) const {
    return is_covered() ? under_cover(cos) : rest(1.0f, 0.0f, base);
  }
  Shares mean() const;  // 2 int at(cos) cos dcos
  // Of the GGX layer, without the coat.
  const GgxAlbedo& base() const { return base_; }
  float base_mean() const { return base_.means().plain.albedo.white(); }
  // Reflected by the coat.
  float coat(float cos) const {
    return coat_ > 0.0f ? coat_ * coat_albedo_.albedo(cos).of(kCoatF0, 1.0f) : 0.0f;
  }
  // What the coat lets through one way, to and from the GGX layer.
  float through_coat(float cos) const {
    return coat_ > 0.0f ? through_ - through_fifth_ * fifth_power_of_rest(cos) : 1.0f;
  }
  // Reflected by sheen of colour 1 under the coat, and its mean 2 int sheen(cos) cos dcos.
  float sheen(float cos) const { return sheen_.at(cos) * (1.0f - coat(cos)); }
  float sheen_mean() const;
  // What sheen leaves of light to what is below it.
  float through_sheen(float cos) const { return 1.0f - sheen_color_ * sheen_.at(cos); }
  static constexpr float kCoatF0 = 0.04f;  // index of refraction 1.5

 private:
  bool is_covered() const { return coat_ > 0.0f || sheen_color_ > 0.0f; }
  Shares under_cover(float cos) const;
  // What is left of `all` light under the coat's and the layer's integrals.
  Shares rest(float all, float coat, const ByFresnel& reflected) const {
    return {std::max(0.0f, all - coat - reflected.of(under_f0_, under_f90_)),
            std::max(0.0f, all - coat - reflected.white())};
  }
  Shares rest(float all, const ByFresnel& coat, const GgxAlbedo::Means& layer) const;

  GgxAlbedo base_, coat_albedo_;
  SheenAlbedo sheen_;
  float sheen_color_ = 0.0f;  // the largest channel
  float under_f0_ = 0.0f, under_f90_ = 0.0f;
  bool layer_ = false;
  float coat_ = 0.0f, through_ = 1.0f, through_fifth_ = 0.0f;
};

// A KeptLight with its means. A material whose layers are the same everywhere computes it once.
struct KeptLayers {
  KeptLayers() = default;
  explicit KeptLayers(const Bsdf& bsdf);
  KeptLight light;
  KeptLight::Shares mean{};
  float base_mean = 0.0f;  // of metal only
};

}  // namespace kiln

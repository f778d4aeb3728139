// The closure of every material at a point: a Lambert layer under a GGX layer, optionally under sheen and a
// clear coat; what single scattering loses in the layers returns (docs/maths.md, "Materials").
#pragma once

#include "common/math/frame.h"
#include "worker/materials/kept_light.h"

namespace kiln {

struct Bsdf {
  Vec3 diffuse{0.0f};  // albedo of the Lambert layer
  Vec3 f0{0.0f};       // reflectance of the GGX layer at normal incidence,
  float f90 = 0.0f;    // and at grazing; both 0: no such layer
  float alpha = 1.0f;  // GGX width, roughness squared
  // f0 and f90 of the dielectric share of that layer: light it does not reflect reaches the layers below.
  float under_f0 = 0.0f, under_f90 = 0.0f;
  // The metal's share of that layer, and its f0: between its facets light bounces on.
  float metallic = 0.0f;
  Vec3 metal{0.0f};
  // Glass: colour of the light transmitted straight (refraction does not bend it), times what the layers do
  // not reflect; and the absorption inside, per metre.
  Vec3 transmission{0.0f}, absorption{0.0f};
  // On top: sheen (colour, roughness), and a clear coat of index 1.5 (weight, GGX width).
  Vec3 sheen{0.0f};
  float sheen_roughness = 0.0f;
  float coat = 0.0f, coat_alpha = 1.0f;
  // KeptLayers(*this), if the material computed it ahead; it belongs to the material.
  const KeptLayers* kept = nullptr;

  bool has_specular() const { return f90 > 0.0f || max_component(f0) > 0.0f; }
  bool has_diffuse() const { return max_component(diffuse) > 0.0f; }
  bool has_sheen() const { return max_component(sheen) > 0.0f; }
  bool is_covered() const { return coat > 0.0f || has_sheen(); }
};

// The layers that a material's closures may have, which select the integrator's loops: Lambert only; GGX over
// it; also transmission, sheen or a coat.
enum class Layers { kLambert, kGgx, kGeneral };

struct BsdfSample {
  Vec3 direction;     // local; z along the shading normal
  Vec3 weight{0.0f};  // f cos / pdf; zero: the path ends
  float pdf = 0.0f;   // per steradian, of all lobes together
};

struct BsdfValue {
  Vec3 f{0.0f};      // without the cosine
  float pdf = 0.0f;  // of sample(), per steradian
};

// Reflectance of the GGX layer for a cosine (0, 1] between half vector and light (Schlick 1994).
Vec3 fresnel(const Bsdf& bsdf, float cos);
// Straight transmittance of the surface at a cosine (0, 1] to its normal: what its layers do not reflect.
Vec3 straight_through(const Bsdf& bsdf, float cos);

// A Bsdf for one fixed wo, so that evaluating and sampling share work. Directions are local, unit and point
// away from the surface; light leaves along wo.
class BsdfAtWo {
 public:
  BsdfAtWo() = default;  // black
  BsdfAtWo(const Bsdf& bsdf, const Vec3& wo) : bsdf_(bsdf) { set_wo(wo); }
  // The same in steps, without a copy: fill in layers(), then set_cosine(), after which the Lambert share and
  // the chance of the rest are known, then set_direction() with a wo of that z.
  Bsdf& layers() { return bsdf_; }
  void set_cosine(float cos);
  void set_direction(const Vec3& wo);
  void set_wo(const Vec3& wo) {
    set_cosine(wo.z);
    set_direction(wo);
  }

  BsdfValue value(const Vec3& wi) const {
    if (wo_.z <= 0.0f || wi.z <= 0.0f) return {};
    if (!layered_) return {bsdf_.diffuse * kInvPi, wi.z * kInvPi};
    return layered(wi);
  }
  BsdfSample sample(float u_layer, const Vec2& u) const;

  // A Lambert lobe that stands for a large part of the closure: its reflectance towards wo; black if it would
  // be less than a tenth of all. Reflects as much of a uniform irradiance as the lobes below the layers do.
  Vec3 lambert_share() const;
  // The share of samples that the rest of the closure is worth; 0: there is none.
  float chance_of_rest() const;
  // Takes that lobe away: value() and sample() are then of the rest, which may be negative.
  void take_lambert_share();
  // The rest's part of value(wi).f, by channel; may be negative.
  Vec3 rest_of_share(const Vec3& wi) const;

 private:
  // Luminances that the lobes reflect towards wo, in the order of sampling.
  struct Lobes {
    float coat = 0.0f, uniform = 0.0f, ggx = 0.0f, cosine = 0.0f;
    float sum() const { return coat + uniform + ggx + cosine; }
  };
  const KeptLayers& kept() const { return bsdf_.kept ? *bsdf_.kept : own_; }
  Lobes without_share() const;
  void choose(Lobes lobes);
  BsdfValue layered(const Vec3& wi) const;

  Bsdf bsdf_;
  Vec3 wo_{0.0f};
  bool layered_ = false, covered_ = false;
  KeptLayers own_;                        // unless the material has it
  Vec3 under_wo_{0.0f}, metal_wo_{0.0f};  // the lobes below the layers: times the shares at wi, over pi
  Vec3 share_{0.0f}, taken_{0.0f};        // the Lambert lobe; the same once it is taken away, over pi
  float smith_wo_ = 0.0f, coat_smith_wo_ = 0.0f;
  float through_wo_ = 1.0f;  // of the coat, one way
  Vec3 sheen_wo_{0.0f};      // sheen's lobe: times kept().light.sheen(wi), over pi
  float through_sheen_wo_ = 1.0f;
  Lobes lobes_, chance_;  // chance_: of all samples
};

// A BsdfAtWo known to have only the Lambert layer.
class LambertAtWo {
 public:
  LambertAtWo() = default;
  LambertAtWo(const Vec3& albedo, const Vec3& wo) : albedo_(wo.z > 0.0f ? albedo : Vec3(0.0f)) {}
  BsdfValue value(const Vec3& wi) const { return {albedo_ * kInvPi, wi.z * kInvPi}; }
  BsdfSample sample(float, const Vec2& u) const {
    const Vec3 wi = cosine_hemisphere(u);
    return {wi, wi.z > 0.0f ? albedo_ : Vec3(0.0f), wi.z * kInvPi};
  }
  Vec3 rest_of_share(const Vec3&) const { return Vec3(0.0f); }

 private:
  Vec3 albedo_{0.0f};
};

}  // namespace kiln

// The closure of every material at a point: a Lambert layer under a GGX layer, optionally under sheen and a
// clear coat (docs/maths.md, "Materials").
#pragma once

#include "common/math/frame.h"
#include "common/math/warp.h"

namespace kiln {

struct Bsdf {
  Vec3 diffuse{0.0f};  // albedo of the Lambert layer
  Vec3 f0{0.0f};       // reflectance of the GGX layer at normal incidence,
  float f90 = 0.0f;    // and at grazing; both 0: no such layer
  float alpha = 1.0f;  // GGX width, roughness squared
  // The same for the dielectric share of that layer: light it does not reflect reaches the layers below.
  float under_f0 = 0.0f, under_f90 = 0.0f;
  // Glass: colour of the light transmitted straight (refraction does not bend it), times 1 - F at the
  // surface; and the absorption inside, per metre.
  Vec3 transmission{0.0f}, absorption{0.0f};
  // On top: sheen (colour, roughness), and a clear coat of index 1.5 (weight, GGX width).
  Vec3 sheen{0.0f};
  float sheen_roughness = 0.0f;
  float coat = 0.0f, coat_alpha = 1.0f;

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
  float pdf = 0.0f;   // per steradian, of all layers together
};

struct BsdfValue {
  Vec3 f{0.0f};      // without the cosine
  float pdf = 0.0f;  // of sample(), per steradian
};

// Reflectance of the GGX layer for a cosine (0, 1] between half vector and light (Schlick 1994).
Vec3 fresnel(const Bsdf& bsdf, float cos);
// Straight transmittance of the surface at a cosine (0, 1] to its normal.
Vec3 straight_through(const Bsdf& bsdf, float cos);

// A Bsdf for one fixed wo, so that evaluating and sampling share work. Directions are local, unit and point
// away from the surface; light leaves along wo.
class BsdfAtWo {
 public:
  BsdfAtWo() = default;  // black
  BsdfAtWo(const Bsdf& bsdf, const Vec3& wo) : bsdf_(bsdf) { set_wo(wo); }
  // The same in two steps, without a copy: fill in layers(), then set_wo.
  Bsdf& layers() { return bsdf_; }
  void set_wo(const Vec3& wo);

  BsdfValue value(const Vec3& wi) const {
    if (wo_.z <= 0.0f || wi.z <= 0.0f) return {};
    if (!layered_) return {bsdf_.diffuse * kInvPi, wi.z * kInvPi};
    return covered_ ? covered(wi) : base(wi);
  }
  BsdfSample sample(float u_layer, const Vec2& u) const;

  // Share of a uniform irradiance that the Lambert layer reflects towards wo, if that layer is separable from
  // those above it (no sheen, no coat); else black.
  Vec3 diffuse_share() const;
  // Removes the Lambert layer, whose part diffuse_share() gives. Returns the share of samples for the
  // remaining layers; 0: none remain.
  float drop_diffuse();
  // Share of value(wi).f due to the layers above the Lambert one.
  Vec3 share_above_diffuse(const Vec3& wi) const;

 private:
  void cover();
  BsdfValue base(const Vec3& wi) const;
  BsdfValue covered(const Vec3& wi) const;

  Bsdf bsdf_;
  Vec3 wo_{0.0f};
  bool layered_ = false, covered_ = false;
  float p_specular_ = 0.0f;  // share of the base's samples for the GGX layer
  float smith_wo_ = 0.0f;
  float entered_ = 0.0f;  // share transmitted below the GGX layer, over its mean
  // Shares of all samples, and precomputed terms of the layers over the base.
  float p_coat_ = 0.0f, p_sheen_ = 0.0f;
  float coat_smith_wo_ = 0.0f, coat_wo_ = 0.0f;
  float sheen_wo_ = 0.0f;
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
  Vec3 share_above_diffuse(const Vec3&) const { return Vec3(0.0f); }

 private:
  Vec3 albedo_{0.0f};
};

}  // namespace kiln

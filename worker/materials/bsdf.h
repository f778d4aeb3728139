// The closure every material yields at a point: a Lambert layer under a GGX layer, and over them, where the
// material has them, sheen and a clear coat (docs/maths.md, "Materials").
#pragma once

#include "common/math/frame.h"
#include "common/math/warp.h"

namespace kiln {

struct Bsdf {
  Vec3 diffuse{0.0f};  // albedo of the Lambert layer
  Vec3 f0{0.0f};       // reflectance of the GGX layer at normal incidence,
  float f90 = 0.0f;    // and at grazing; both 0: no such layer
  float alpha = 1.0f;  // GGX width, roughness squared
  // The same two of the dielectric share of that layer: what does not reflect there meets what lies below.
  float under_f0 = 0.0f, under_f90 = 0.0f;
  // Glass: colour of what enters and goes straight on (refraction bends nothing here), times 1 - F at the
  // surface; and what the inside absorbs on the way, per metre.
  Vec3 transmission{0.0f}, absorption{0.0f};
  // Over all that: sheen (colour, roughness), and a clear coat of index 1.5 (weight, GGX width).
  Vec3 sheen{0.0f};
  float sheen_roughness = 0.0f;
  float coat = 0.0f, coat_alpha = 1.0f;

  bool has_specular() const { return f90 > 0.0f || max_component(f0) > 0.0f; }
  bool has_diffuse() const { return max_component(diffuse) > 0.0f; }
  bool has_sheen() const { return max_component(sheen) > 0.0f; }
  bool is_covered() const { return coat > 0.0f || has_sheen(); }
};

// What the closures of a material may consist of, so that a scene can say which loops it needs: Lambert
// alone; GGX over it; transmission, sheen or a coat too.
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

// Reflectance of the GGX layer where the half vector makes a cosine (0, 1] with the light (Schlick 1994).
Vec3 fresnel(const Bsdf& bsdf, float cos);
// Share of light that goes straight through the surface, met under a cosine (0, 1] to its normal.
Vec3 straight_through(const Bsdf& bsdf, float cos);

// A Bsdf seen from one direction: what evaluating and sampling share is found once. Directions are local,
// unit and leave the surface; wo is towards where the light goes.
class BsdfAtWo {
 public:
  BsdfAtWo() = default;  // black
  BsdfAtWo(const Bsdf& bsdf, const Vec3& wo) : bsdf_(bsdf) { set_wo(wo); }
  // The same in two steps: fill in layers(), then look. Nothing is copied.
  Bsdf& layers() { return bsdf_; }
  void set_wo(const Vec3& wo);

  BsdfValue value(const Vec3& wi) const {
    if (wo_.z <= 0.0f || wi.z <= 0.0f) return {};
    if (!layered_) return {bsdf_.diffuse * kInvPi, wi.z * kInvPi};
    return covered_ ? covered(wi) : base(wi);
  }
  BsdfSample sample(float u_layer, const Vec2& u) const;

  // What the Lambert layer sends towards wo of an irradiance that comes evenly from all sides, as a share,
  // where that layer stands apart from the ones above it (no sheen, no coat); black where it does not.
  Vec3 diffuse_share() const;
  // Takes the Lambert layer away: what is left is what diffuse_share() leaves out. Returns the share of
  // samples that go there; 0: nothing is left.
  float drop_diffuse();
  // Share of value(wi).f that is of the layers above the Lambert one.
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
  float entered_ = 0.0f;  // share that gets under the GGX layer, over its mean
  // Shares of all samples, and what evaluating the layers over the base needs.
  float p_coat_ = 0.0f, p_sheen_ = 0.0f;
  float coat_smith_wo_ = 0.0f, coat_wo_ = 0.0f;
  float sheen_wo_ = 0.0f;
};

// A BsdfAtWo of which the Lambert layer is known to be all.
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

// Lambert + GGX as glTF 2.0 appendix B mixes them: f = (1 - F) diffuse/pi + F D G2 / (4 cos cos), with
// Schlick's F at the half vector, so that the sum is reciprocal and reflects no more than it receives.
// Heitz 2014, Understanding the Masking-Shadowing Function (height-correlated Smith), and Dupuy & Benyoub
// 2023, Sampling Visible GGX Normals with Spherical Caps, CGF 42(8), listing 3. Departure: isotropic only.
#include "worker/materials/bsdf.h"

namespace kiln {
namespace {

Vec3 schlick(const Vec3& f0, float cos_h) {
  const float m = std::clamp(1.0f - cos_h, 0.0f, 1.0f);
  const float m2 = m * m;
  return f0 + (Vec3(1.0f) - f0) * (m2 * m2 * m);
}

float ggx_d(const Vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  const float t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;  // (1 - z^2) + a^2 z^2 without cancellation
  return a2 * kInvPi / (t * t);
}

// cos x (1 + 2 Lambda): Smith's masking without a division by a cosine that may be next to nothing.
float smith(float cos, float alpha) {
  const float a2 = alpha * alpha;
  return std::sqrt(a2 + (1.0f - a2) * cos * cos);
}

// Dupuy & Benyoub 2023: in the stretched space where the surface is a hemisphere, the reflections of wo off
// its visible normals fill a cap uniformly.
Vec3 sample_visible_normal(const Vec3& wo, float alpha, const Vec2& u) {
  const Vec3 v = normalize_or(Vec3(alpha * wo.x, alpha * wo.y, wo.z), Vec3(0, 0, 1));
  const Vec3 n = v + spherical(1.0f - u.x * (1.0f + v.z), u.y);
  return normalize_or(Vec3(alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)), Vec3(0, 0, 1));
}

// Share of samples for the GGX layer: by reflectance at this angle, kept away from 0 and 1 so that
// neither layer starves.
float specular_probability(const Bsdf& b, const Vec3& wo) {
  if (!b.has_diffuse()) return 1.0f;
  const float s = luminance(schlick(b.f0, wo.z)), d = luminance(b.diffuse);
  return std::clamp(s / (s + d), 0.1f, 0.9f);
}

}  // namespace

Vec3 fresnel(const Bsdf& bsdf, float cos) {
  return schlick(bsdf.f0, cos);
}

Vec3 straight_through(const Bsdf& bsdf, float cos) {
  return bsdf.transmission * (Vec3(1.0f) - schlick(bsdf.f0, cos));
}

SeenBsdf::SeenBsdf(const Bsdf& bsdf, const Vec3& wo) : bsdf_(bsdf), wo_(wo), glossy_(bsdf.has_specular()) {
  if (!glossy_) return;
  p_specular_ = specular_probability(bsdf, wo);
  smith_wo_ = smith(wo.z, bsdf.alpha);
}

BsdfValue SeenBsdf::layered(const Vec3& wi) const {
  const Bsdf& b = bsdf_;
  const Vec3 h = normalize_or(wo_ + wi, Vec3(0, 0, 1));
  const Vec3 f = schlick(b.f0, dot(wi, h));
  const float d = ggx_d(h, b.alpha);
  // G2 / (4 cos cos) of the height-correlated form.
  const float visibility = 0.5f / (wo_.z * smith(wi.z, b.alpha) + wi.z * smith_wo_);
  BsdfValue v;
  v.f = (Vec3(1.0f) - f) * b.diffuse * kInvPi + f * (d * visibility);
  // Density of visible normals G1 max(0, wo.h) D / wo.z, times the Jacobian 1/(4 wo.h), where
  // G1 / wo.z = 2 / (wo.z + smith(wo)).
  v.pdf = (1.0f - p_specular_) * wi.z * kInvPi + p_specular_ * d / (2.0f * (wo_.z + smith_wo_));
  return v;
}

BsdfSample SeenBsdf::sample(float u_layer, const Vec2& u) const {
  BsdfSample s;
  if (wo_.z <= 0.0f || (!glossy_ && !bsdf_.has_diffuse())) return s;
  if (!glossy_) {
    s.direction = cosine_hemisphere(u);
    s.pdf = s.direction.z * kInvPi;
    if (s.pdf > 0.0f) s.weight = bsdf_.diffuse;
    return s;
  }
  if (u_layer < p_specular_) {
    const Vec3 h = sample_visible_normal(wo_, bsdf_.alpha, u);
    s.direction = h * (2.0f * dot(wo_, h)) - wo_;
  } else {
    s.direction = cosine_hemisphere(u);
  }
  // Whichever layer chose the direction, the estimate divides by the density of both (the one-sample
  // model of Veach 1995): f / pdf is bounded, so picking a layer makes no fireflies.
  const BsdfValue v = value(s.direction);
  s.pdf = v.pdf;
  if (s.pdf > 0.0f) s.weight = v.f * (s.direction.z / s.pdf);
  return s;
}

}  // namespace kiln

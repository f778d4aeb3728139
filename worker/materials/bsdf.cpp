// The layers of glTF 2.0 appendix B and of KHR_materials_specular, _clearcoat and _sheen, in reciprocal,
// energy-conserving forms:
//   base = (1 - F(o)) (1 - F(i)) / (1 - mean F) diffuse/pi + F(h) D G2 / (4 cos cos)
// Shirley, Smits, Hu & Lafortune 1997, A Practitioners' Assessment of Light Reflection Models, section 3.
// Departure from glTF, which uses 1 - F(h) for the first factor and so reflects up to twice the incident
// light at grazing angles. GGX: Heitz 2014, Understanding the Masking-Shadowing Function (height-correlated
// Smith), and Dupuy & Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps, CGF 42(8), listing 3.
// Departure: isotropic only.
#include "worker/materials/bsdf.h"

#include "worker/materials/sheen.h"

namespace kiln {
namespace {

constexpr float kCoatF0 = 0.04f;  // index of refraction 1.5
// Rough layers reflect up to 0.0022 more than F at the cosine, because F is convex and their normals scatter:
// the layers below receive that much less.
constexpr float kScatterMargin = 0.0025f;

float fifth_power_of_rest(float cos) {
  const float m = std::clamp(1.0f - cos, 0.0f, 1.0f);
  const float m2 = m * m;
  return m2 * m2 * m;
}
Vec3 schlick(const Vec3& f0, float f90, float cos) {
  return f0 + (Vec3(f90) - f0) * fifth_power_of_rest(cos);
}
float schlick(float f0, float f90, float cos) {
  return f0 + (f90 - f0) * fifth_power_of_rest(cos);
}
float coat_fresnel(float cos) {
  return schlick(kCoatF0, 1.0f, cos);
}

float ggx_d(const Vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  const float t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;  // (1 - z^2) + a^2 z^2 without cancellation
  return a2 * kInvPi / (t * t);
}

// cos x (1 + 2 Lambda): Smith's masking without dividing by a cosine that may be tiny.
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
Vec3 sample_reflection(const Vec3& wo, float alpha, const Vec2& u) {
  const Vec3 h = sample_visible_normal(wo, alpha, u);
  return h * (2.0f * dot(wo, h)) - wo;
}

// Height-correlated G2 / (4 cos cos).
float visibility(float cos_o, float smith_o, float cos_i, float smith_i) {
  return 0.5f / (cos_o * smith_i + cos_i * smith_o);
}
// Density of visible normals G1 max(0, wo.h) D / wo.z, times the Jacobian 1/(4 wo.h), where
// G1 / wo.z = 2 / (wo.z + smith(wo)).
float reflection_pdf(float d, float cos_o, float smith_o) {
  return d / (2.0f * (cos_o + smith_o));
}

// Dielectric reflectance over the layers below, with the margin of rough layers.
float over_diffuse(const Bsdf& b, float cos) {
  return schlick(b.under_f0 + kScatterMargin * (b.under_f90 - b.under_f0), b.under_f90, cos);
}

// Share of samples for the GGX layer: by reflectance at this angle, kept away from 0 and 1 so that
// neither layer starves.
float specular_probability(const Bsdf& b, const Vec3& wo) {
  if (!b.has_diffuse()) return 1.0f;
  const float s = luminance(schlick(b.f0, b.f90, wo.z)), d = luminance(b.diffuse);
  return std::clamp(s / (s + d), 0.1f, 0.9f);
}

// Transmittance of the coat, down and up: that of the more grazing direction, which makes it reciprocal, as
// KHR_materials_sheen does for its own layer.
float through_coat(const Bsdf& b, float flatter) {
  return 1.0f - b.coat * schlick(kCoatF0 + kScatterMargin * (1.0f - kCoatF0), 1.0f, flatter);
}
float through_sheen(const Bsdf& b, float albedo) {
  return 1.0f - max_component(b.sheen) * albedo;
}

}  // namespace

Vec3 fresnel(const Bsdf& bsdf, float cos) {
  return schlick(bsdf.f0, bsdf.f90, cos);
}

Vec3 straight_through(const Bsdf& bsdf, float cos) {
  Vec3 through = bsdf.transmission * (1.0f - schlick(bsdf.under_f0, bsdf.under_f90, cos));
  if (bsdf.coat > 0.0f) through *= through_coat(bsdf, cos);
  if (bsdf.has_sheen()) through *= through_sheen(bsdf, SheenAlbedo(bsdf.sheen_roughness).at(cos));
  return through;
}

void BsdfAtWo::set_wo(const Vec3& wo) {
  const Bsdf& bsdf = bsdf_;
  wo_ = wo;
  covered_ = bsdf.is_covered();
  layered_ = covered_ || bsdf.has_specular();
  if (!layered_) return;
  p_specular_ = smith_wo_ = p_coat_ = p_sheen_ = 0.0f;
  if (bsdf.has_specular()) {
    p_specular_ = specular_probability(bsdf, wo);
    smith_wo_ = smith(wo.z, bsdf.alpha);
  }
  // The mean of Schlick's F over the cosine-weighted hemisphere is f0 + (f90 - f0)/21.
  const float low = bsdf.under_f0 + kScatterMargin * (bsdf.under_f90 - bsdf.under_f0);
  const float kept = 1.0f - low - (bsdf.under_f90 - low) / 21.0f;
  entered_ = kept > 0.0f ? std::max(0.0f, 1.0f - over_diffuse(bsdf, wo.z)) / kept : 0.0f;
  if (covered_) cover();
}

void BsdfAtWo::cover() {
  const Bsdf& b = bsdf_;
  const float cos = std::max(wo_.z, 0.0f);
  coat_smith_wo_ = smith(cos, b.coat_alpha);
  coat_wo_ = b.coat * coat_fresnel(cos);
  float sheen = 0.0f;
  if (b.has_sheen()) {
    sheen_wo_ = SheenAlbedo(b.sheen_roughness).at(cos);
    sheen = luminance(b.sheen) * sheen_wo_;
  }
  const float below = luminance(b.diffuse) + luminance(schlick(b.f0, b.f90, cos));
  // Shares by reflectance at this angle, each existing one at least a tenth of the sum before scaling.
  const float least = 0.1f * std::max(coat_wo_ + sheen + below, 1e-6f);
  const float w_coat = b.coat > 0.0f ? std::max(coat_wo_, least) : 0.0f;
  const float w_sheen = b.has_sheen() ? std::max(sheen, least) : 0.0f;
  const float w_base = b.has_diffuse() || b.has_specular() ? std::max(below, least) : 0.0f;
  const float total = w_coat + w_sheen + w_base;
  p_coat_ = w_coat / total;
  p_sheen_ = w_sheen / total;
}

BsdfValue BsdfAtWo::base(const Vec3& wi) const {
  const Bsdf& b = bsdf_;
  BsdfValue v;
  if (smith_wo_ > 0.0f) {
    const Vec3 h = normalize_or(wo_ + wi, Vec3(0, 0, 1));
    const float d = ggx_d(h, b.alpha);
    v.f = schlick(b.f0, b.f90, dot(wi, h)) * (d * visibility(wo_.z, smith_wo_, wi.z, smith(wi.z, b.alpha)));
    v.pdf = p_specular_ * reflection_pdf(d, wo_.z, smith_wo_);
  }
  v.f += b.diffuse * (kInvPi * entered_ * std::max(0.0f, 1.0f - over_diffuse(b, wi.z)));
  v.pdf += (1.0f - p_specular_) * wi.z * kInvPi;
  return v;
}

BsdfValue BsdfAtWo::covered(const Vec3& wi) const {
  const Bsdf& b = bsdf_;
  BsdfValue v = base(wi);
  v.pdf *= std::max(0.0f, 1.0f - p_coat_ - p_sheen_);
  if (b.has_sheen()) {
    // Departure from the extension: a separable lobe with the albedo of Charlie's instead of Charlie's
    // itself.
    const SheenAlbedo albedo(b.sheen_roughness);
    const float sheen_wi = albedo.at(wi.z);
    v.f = v.f * through_sheen(b, std::max(sheen_wo_, sheen_wi)) +
          b.sheen * (kInvPi * sheen_wo_ * sheen_wi / albedo.mean());
    v.pdf += p_sheen_ * 0.5f * kInvPi;
  }
  if (b.coat > 0.0f) {
    const Vec3 h = normalize_or(wo_ + wi, Vec3(0, 0, 1));
    const float d = ggx_d(h, b.coat_alpha);
    const float coat = b.coat * coat_fresnel(dot(wi, h)) * d *
                       visibility(wo_.z, coat_smith_wo_, wi.z, smith(wi.z, b.coat_alpha));
    v.f = v.f * through_coat(b, std::min(wo_.z, wi.z)) + Vec3(coat);
    v.pdf += p_coat_ * reflection_pdf(d, wo_.z, coat_smith_wo_);
  }
  return v;
}

// From base(): (1 - F(o)) / (1 - mean F) times the mean of 1 - F(i) over the cosine-weighted hemisphere,
// which is also 1 - mean F.
Vec3 BsdfAtWo::diffuse_share() const {
  if (wo_.z <= 0.0f || covered_) return Vec3(0.0f);
  return layered_ ? bsdf_.diffuse * std::max(0.0f, 1.0f - over_diffuse(bsdf_, wo_.z)) : bsdf_.diffuse;
}

float BsdfAtWo::drop_diffuse() {
  const float share = layered_ && wo_.z > 0.0f ? p_specular_ : 0.0f;
  bsdf_.diffuse = Vec3(0.0f);
  set_wo(wo_);
  return share;
}

Vec3 BsdfAtWo::share_above_diffuse(const Vec3& wi) const {
  BsdfAtWo above = *this;
  above.bsdf_.diffuse = Vec3(0.0f);
  const Vec3 all = value(wi).f, part = above.value(wi).f;
  Vec3 share(0.0f);
  for (int k = 0; k < 3; ++k)
    if (all[k] > 0.0f) share[k] = std::min(1.0f, part[k] / all[k]);
  return share;
}

BsdfSample BsdfAtWo::sample(float u_layer, const Vec2& u) const {
  BsdfSample s;
  if (wo_.z <= 0.0f || (!layered_ && !bsdf_.has_diffuse())) return s;
  if (!layered_) {
    s.direction = cosine_hemisphere(u);
    s.pdf = s.direction.z * kInvPi;
    if (s.pdf > 0.0f) s.weight = bsdf_.diffuse;
    return s;
  }
  const float p_over = p_coat_ + p_sheen_;
  if (u_layer < p_coat_) {
    s.direction = sample_reflection(wo_, bsdf_.coat_alpha, u);
  } else if (u_layer < p_over) {
    s.direction = spherical(u.x, u.y);
  } else if (u_layer < p_over + (1.0f - p_over) * p_specular_) {
    s.direction = sample_reflection(wo_, bsdf_.alpha, u);
  } else {
    s.direction = cosine_hemisphere(u);
  }
  // Whichever layer is sampled, the estimate divides by the combined density (the one-sample model of Veach
  // 1995): f / pdf is bounded, so the choice of layer causes no fireflies.
  const BsdfValue v = value(s.direction);
  s.pdf = v.pdf;
  if (s.pdf > 0.0f) s.weight = v.f * (s.direction.z / s.pdf);
  return s;
}

}  // namespace kiln

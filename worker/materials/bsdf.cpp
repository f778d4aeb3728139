// The layers of glTF 2.0 appendix B and of KHR_materials_specular, _clearcoat and _sheen, in reciprocal forms
// that keep energy. A layer reflects F(h) D G2 / (4 cos cos); its albedo E is tabulated (ggx_albedo.h), and
// the rest, 1 - E, goes to the lobes below:
//   dielectric  (1 - E(o)) (1 - E(i)) / (pi (1 - mean E)) diffuse
// Kelemen & Szirmay-Kalos 2001, A Microfacet Based Coupled Specular-Matte BRDF Model, section 2.2. Departure
// from glTF, which uses 1 - F(h) and so reflects up to twice the incident light at grazing angles.
//   metal       the same with F = 1 in E, times the colour of many bounces between facets
// Kulla & Conty 2017, Revisiting Physically Based Shading at Imageworks, pages 7 and 8.
#include "worker/materials/bsdf.h"

namespace kiln {
namespace {

Vec3 schlick(const Vec3& f0, float f90, float cos) {
  return f0 + (Vec3(f90) - f0) * fifth_power_of_rest(cos);
}
// Colour of the light that leaves metal after two and more facets, of the light that one facet alone does not
// return: F^2 E / (1 - F (1 - E)) with the means of F and E.
Vec3 bounced_between_facets(const Bsdf& b, float mean_albedo) {
  const Vec3 f = b.metal + (Vec3(1.0f) - b.metal) * (1.0f / 21.0f);
  return b.metallic * f * f * mean_albedo / (Vec3(1.0f) - f * (1.0f - mean_albedo));
}

}  // namespace

Vec3 fresnel(const Bsdf& bsdf, float cos) {
  return schlick(bsdf.f0, bsdf.f90, cos);
}

Vec3 straight_through(const Bsdf& bsdf, float cos) {
  if (!bsdf.has_specular() && !bsdf.is_covered()) return bsdf.transmission;
  // What a smooth layer reflects is known; tables are for rough ones.
  if (bsdf.alpha <= kLeastAlpha && !bsdf.is_covered())
    return bsdf.transmission *
           (1.0f - bsdf.under_f0 - (bsdf.under_f90 - bsdf.under_f0) * fifth_power_of_rest(cos));
  return bsdf.transmission * KeptLight(bsdf).at(cos).under;
}

// What the lobes reflect towards wo.
void BsdfAtWo::set_cosine(float wo_z) {
  const Bsdf& b = bsdf_;
  wo_.z = wo_z;
  covered_ = b.is_covered();
  layered_ = covered_ || b.has_specular();
  if (!layered_) return;
  if (!b.kept) own_ = KeptLayers(b);
  const KeptLayers& kept = this->kept();
  const float cos = std::max(wo_z, 0.0f);
  ByFresnel base;
  lobes_ = {};
  if (b.has_specular()) {
    base = kept.light.base().albedo(cos);
    lobes_.ggx = luminance(b.f0 * base.f0 + Vec3(b.f90 * base.f90));
    if (covered_) lobes_.ggx *= kept.light.through_coat(cos);
  }
  const KeptLight::Shares shares = kept.light.at(cos, base);
  Vec3 under(0.0f), metal(0.0f);
  under_wo_ = metal_wo_ = share_ = Vec3(0.0f);
  if (kept.mean.under > 0.0f) {
    under = b.diffuse * shares.under;
    under_wo_ = under / kept.mean.under;
  }
  if (b.metallic > 0.0f && kept.mean.metal > 0.0f) {
    metal = bounced_between_facets(b, kept.base_mean) * shares.metal;
    metal_wo_ = metal / kept.mean.metal;
  }
  if (covered_) {
    lobes_.coat = kept.light.coat(cos);
    const Vec3 sheen = b.sheen * kept.light.sheen(cos);
    const float mean = kept.light.sheen_mean();
    sheen_wo_ = mean > 0.0f ? sheen / mean : Vec3(0.0f);
    lobes_.uniform = luminance(sheen);
    share_ = sheen;
  }
  // Where little is kept it is kept at grazing angles: the cosine would find that rarely.
  lobes_.uniform += luminance(metal);
  (kept.mean.under < 0.5f ? lobes_.uniform : lobes_.cosine) += luminance(under);
  share_ += under + metal;
}

void BsdfAtWo::set_direction(const Vec3& wo) {
  const Bsdf& b = bsdf_;
  wo_ = wo;
  if (!layered_) return;
  taken_ = Vec3(0.0f);
  const float cos = std::max(wo.z, 0.0f);
  smith_wo_ = b.has_specular() ? ggx_smith(cos, b.alpha) : 0.0f;
  if (covered_) {
    const KeptLight& light = kept().light;
    coat_smith_wo_ = b.coat > 0.0f ? ggx_smith(cos, b.coat_alpha) : 0.0f;
    through_wo_ = light.through_coat(cos);
    through_sheen_wo_ = light.through_sheen(cos);
  }
  choose(lobes_);
}

// Each lobe that is there gets a tenth at least, so that f / pdf is bounded; but the lobe between the facets
// of metal is bounded by its own density, and may vanish.
void BsdfAtWo::choose(Lobes lobes) {
  const Bsdf& b = bsdf_;
  const float least = 0.1f * std::max(lobes.sum(), 1e-6f);
  const auto raise = [&](float& lobe, bool there) {
    if (there) lobe = std::max(lobe, least);
  };
  raise(lobes.coat, b.coat > 0.0f);
  raise(lobes.uniform, b.has_sheen());
  raise(lobes.ggx, b.has_specular());
  raise(lobes.cosine, b.has_diffuse() && lobes_.cosine > 0.0f);
  const float total = lobes.sum();
  chance_ = total > 0.0f
                ? Lobes{lobes.coat / total, lobes.uniform / total, lobes.ggx / total, lobes.cosine / total}
                : Lobes{0.0f, 0.0f, 0.0f, 1.0f};
}

BsdfValue BsdfAtWo::layered(const Vec3& wi) const {
  const Bsdf& b = bsdf_;
  const KeptLight& light = kept().light;
  const KeptLight::Shares shares = light.at(wi.z);
  BsdfValue v;
  v.f = (under_wo_ * shares.under + metal_wo_ * shares.metal) * kInvPi;
  v.pdf = (chance_.cosine * wi.z + 0.5f * chance_.uniform) * kInvPi;
  const Vec3 h = normalize_or(wo_ + wi, Vec3(0, 0, 1));
  float through = 1.0f;
  if (covered_) {
    // Departure from KHR_materials_sheen: a separable lobe with the albedo of Charlie's instead of Charlie's
    // itself. Of the GGX layer the more grazing direction lets less through, as the extension has it.
    v.f += sheen_wo_ * (light.sheen(wi.z) * kInvPi);
    through = through_wo_ * light.through_coat(wi.z) * std::min(through_sheen_wo_, light.through_sheen(wi.z));
  }
  if (smith_wo_ > 0.0f) {
    const float d = ggx_d(h, b.alpha);
    const float lobe = d * ggx_visibility(wo_.z, smith_wo_, wi.z, ggx_smith(wi.z, b.alpha));
    v.f += schlick(b.f0, b.f90, dot(wi, h)) * (lobe * through);
    v.pdf += chance_.ggx * ggx_reflection_pdf(d, wo_.z, smith_wo_);
  }
  if (covered_ && b.coat > 0.0f) {
    const float d = ggx_d(h, b.coat_alpha);
    const float lobe = d * ggx_visibility(wo_.z, coat_smith_wo_, wi.z, ggx_smith(wi.z, b.coat_alpha));
    v.f += Vec3(b.coat *
                (KeptLight::kCoatF0 + (1.0f - KeptLight::kCoatF0) * fifth_power_of_rest(dot(wi, h))) * lobe);
    v.pdf += chance_.coat * ggx_reflection_pdf(d, wo_.z, coat_smith_wo_);
  }
  v.f -= taken_;
  return v;
}

Vec3 BsdfAtWo::lambert_share() const {
  if (wo_.z <= 0.0f) return Vec3(0.0f);
  if (!layered_) return bsdf_.diffuse;
  return luminance(share_) > 0.1f * lobes_.sum() ? share_ : Vec3(0.0f);
}

// The lobes below the layers are left with the difference of their shapes to the cosine's. These parts bound
// the noise it makes; they cannot change a mean.
auto BsdfAtWo::without_share() const -> Lobes {
  Lobes rest = lobes_;
  rest.cosine *= 0.1f;
  rest.uniform *= 0.5f;
  return rest;
}

float BsdfAtWo::chance_of_rest() const {
  if (!layered_ || wo_.z <= 0.0f) return 0.0f;
  return std::clamp(without_share().sum() / lobes_.sum(), 0.1f, 0.9f);
}

void BsdfAtWo::take_lambert_share() {
  taken_ = share_ * kInvPi;
  choose(without_share());
}

Vec3 BsdfAtWo::rest_of_share(const Vec3& wi) const {
  if (!layered_) return Vec3(0.0f);
  const Vec3 all = value(wi).f;
  Vec3 rest(0.0f);
  for (int k = 0; k < 3; ++k)
    if (all[k] > 0.0f) rest[k] = 1.0f - share_[k] * kInvPi / all[k];
  return rest;
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
  float u_rest = u_layer - chance_.coat;
  if (u_rest < 0.0f) {
    s.direction = ggx_reflection(wo_, bsdf_.coat_alpha, u);
  } else if ((u_rest -= chance_.uniform) < 0.0f) {
    s.direction = spherical(u.x, u.y);
  } else if ((u_rest -= chance_.ggx) < 0.0f) {
    s.direction = ggx_reflection(wo_, bsdf_.alpha, u);
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

#include "worker/materials/metallic_roughness.h"

namespace kiln {

MetallicRoughness MetallicRoughness::parse(RecordReader& r, const Scene& scene) {
  MetallicRoughness m;
  const Vec4 base = r.vec4("base_color", Vec4(1.0f));
  m.base_color_ = within(Vec3(base), 0.0f, 1.0f);
  m.metallic_ = within(r.number("metallic", 1.0f), 0.0f, 1.0f);
  m.roughness_ = within(r.number("roughness", 1.0f), 0.0f, 1.0f);
  // An index of 0 means a reflectance of 1 (KHR_materials_ior); without a step of the index there is no
  // layer.
  const float ior = within(r.number("ior", 1.5f), 0.0f, 1e6f);
  const float ratio = (ior - 1.0f) / (ior + 1.0f);
  m.dielectric_f0_ = within(r.vec3("specular_color", Vec3(1.0f)), 0.0f, 1e6f) * (ratio * ratio);
  m.specular_ = ior == 1.0f ? 0.0f : within(r.number("specular", 1.0f), 0.0f, 1.0f);
  m.reflects_ = m.specular_ > 0.0f || m.metallic_ > 0.0f;
  m.emission_ = within(r.vec3("emission", Vec3(0.0f)), 0.0f, 0x1.fffffep127f);
  m.base_texture_ = TextureSampler(scene, r.texture("base_color_texture"));
  m.metallic_roughness_texture_ = TextureSampler(scene, r.texture("metallic_roughness_texture"));
  m.emission_texture_ = TextureSampler(scene, r.texture("emission_texture"));
  m.alpha_ = Alpha(r, within(base.w, 0.0f, 1.0f), m.base_texture_);
  m.normal_map_ = NormalMap(r, scene);
  m.double_sided_ = r.number("double_sided", 0.0f) != 0.0f;
  m.extra_ = ExtraLayers::parse(r, scene);
  // The base colour may vary: it is below the layers.
  if (m.reflects_ && !m.extra_ && !m.metallic_roughness_texture_) m.kept_ = KeptLayers(m.bsdf({}));
  return m;
}

Bsdf MetallicRoughness::bsdf(const Attributes& a) const {
  const Vec3 color = albedo(a);
  Bsdf b;
  if (!reflects_ && !extra_) {
    b.diffuse = color;
    return b;
  }
  float metallic = metallic_, roughness = roughness_;
  if (metallic_roughness_texture_) {
    const Vec3 t = metallic_roughness_texture_.color(a.uv);
    roughness *= t.y;
    metallic *= t.z;
  }
  Vec3 dielectric = dielectric_f0_;
  float weight = specular_;
  if (extra_) {
    weight *= extra_->specular(a);
    dielectric *= extra_->specular_color(a);
  }
  dielectric = glm::min(dielectric, Vec3(1.0f)) * weight;
  const float rest = 1.0f - metallic;
  b.diffuse = color * rest;
  b.f0 = dielectric * rest + color * metallic;
  b.f90 = weight * rest + metallic;
  b.under_f0 = max_component(dielectric);
  b.under_f90 = weight;
  b.alpha = ggx_alpha(roughness);
  b.metallic = metallic;
  b.metal = color;
  if (kept_) b.kept = &*kept_;
  if (extra_) {
    const float through = extra_->transmission(a);
    b.transmission = b.diffuse * through;
    b.diffuse *= 1.0f - through;
    b.absorption = extra_->absorption();
    extra_->cover(a, b);
  }
  return b;
}

Vec3 MetallicRoughness::emission(const Attributes& a) const {
  return emission_texture_ ? emission_ * emission_texture_.color(a.uv) : emission_;
}

}  // namespace kiln

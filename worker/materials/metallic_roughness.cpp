#include "worker/materials/metallic_roughness.h"

namespace kiln {

MetallicRoughness MetallicRoughness::parse(RecordReader& r, const Scene& scene) {
  MetallicRoughness m;
  m.base_color_ = r.vec4("base_color", Vec4(1.0f));
  m.metallic_ = std::clamp(r.number("metallic", 1.0f), 0.0f, 1.0f);
  m.roughness_ = std::clamp(r.number("roughness", 1.0f), 0.0f, 1.0f);
  const float ior = r.number("ior", 1.5f);
  const float ratio = (ior - 1.0f) / (ior + 1.0f);
  m.dielectric_f0_ = std::clamp(ratio * ratio * r.number("specular", 1.0f), 0.0f, 1.0f);
  m.specular_color_ = r.vec3("specular_color", Vec3(1.0f));
  m.emission_ = glm::max(r.vec3("emission", Vec3(0.0f)), Vec3(0.0f));
  m.base_texture_ = TextureSampler(scene, r.texture("base_color_texture"));
  m.metallic_roughness_texture_ = TextureSampler(scene, r.texture("metallic_roughness_texture"));
  m.emission_texture_ = TextureSampler(scene, r.texture("emission_texture"));
  m.alpha_ = AlphaMode::parse(r);
  m.double_sided_ = r.number("double_sided", 0.0f) != 0.0f;
  return m;
}

Bsdf MetallicRoughness::bsdf(const Attributes& a) const {
  // Albedo above 1 would make energy out of nothing.
  Vec3 color = Vec3(base_color_) * Vec3(a.color);
  if (base_texture_) color *= base_texture_.color(a.uv);
  color = glm::clamp(color, 0.0f, 1.0f);
  float metallic = metallic_, roughness = roughness_;
  if (metallic_roughness_texture_) {
    const Vec3 t = metallic_roughness_texture_.color(a.uv);
    roughness *= t.y;
    metallic *= t.z;
  }
  Bsdf b;
  b.diffuse = color * (1.0f - metallic);
  b.f0 = glm::min(specular_color_ * dielectric_f0_, Vec3(1.0f)) * (1.0f - metallic) + color * metallic;
  // Narrower lobes than 0.02 (roughness 0.14) look the same to a diffuse receiver and only add noise.
  b.alpha = std::max(0.02f, roughness * roughness);
  return b;
}

Vec3 MetallicRoughness::emission(const Attributes& a) const {
  return emission_texture_ ? emission_ * emission_texture_.color(a.uv) : emission_;
}

float MetallicRoughness::opacity(const Attributes& a) const {
  if (is_opaque()) return 1.0f;
  const float factor = base_color_.w * a.color.w;
  return alpha_.opacity(base_texture_ ? factor * base_texture_.alpha(a.uv) : factor);
}

}  // namespace kiln

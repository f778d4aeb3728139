// glTF 2.0 metallic-roughness (specification 3.9.2 and appendix B), with emission and the specular and ior
// factors of KHR_materials_specular and KHR_materials_ior.
#pragma once

#include "worker/materials/attributes.h"
#include "worker/materials/bsdf.h"

namespace kiln {

class MetallicRoughness {
 public:
  static constexpr std::string_view kType = "metallic_roughness";
  static MetallicRoughness parse(RecordReader& r, const Scene& scene);
  Bsdf bsdf(const Attributes& a) const;
  Vec3 emission(const Attributes& a) const;
  EmissionParts emission_parts() const {
    return {emission_, emission_texture_ ? &emission_texture_ : nullptr, false};
  }
  float opacity(const Attributes& a) const;
  bool is_opaque() const { return alpha_.mode == AlphaMode::kOpaque; }
  bool has_layers() const {
    return metallic_ > 0.0f || dielectric_f0_ * max_component(specular_color_) > 0.0f;
  }
  bool is_glass() const { return false; }
  bool is_emissive() const { return max_component(emission_) > 0.0f; }
  bool double_sided() const { return double_sided_; }
  void prefetch(const Attributes& a) const {
    if (base_texture_) base_texture_.prefetch(a.uv);
    if (metallic_roughness_texture_) metallic_roughness_texture_.prefetch(a.uv);
  }
  bool reads_uv(uint32_t set) const {
    return base_texture_.reads_uv(set) || metallic_roughness_texture_.reads_uv(set) ||
           emission_texture_.reads_uv(set);
  }

 private:
  Vec4 base_color_{1.0f};
  float metallic_ = 1.0f, roughness_ = 1.0f;
  float dielectric_f0_ = 0.04f;  // times the specular factor
  Vec3 specular_color_{1.0f};
  Vec3 emission_{0.0f};
  TextureSampler base_texture_, metallic_roughness_texture_, emission_texture_;
  AlphaMode alpha_;
  bool double_sided_ = false;
};

}  // namespace kiln

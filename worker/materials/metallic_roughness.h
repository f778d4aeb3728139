// glTF 2.0 metallic-roughness (specification 3.9.2 and appendix B), with emission, normal map,
// KHR_materials_ior and the layers of extra_layers.h.
#pragma once

#include <optional>

#include "worker/materials/alpha.h"
#include "worker/materials/extra_layers.h"
#include "worker/materials/normal_map.h"

namespace kiln {

class MetallicRoughness {
 public:
  static constexpr std::string_view kType = "metallic_roughness";
  static MetallicRoughness parse(RecordReader& r, const Scene& scene);
  Vec3 albedo(const Attributes& a) const {
    Vec3 color = base_color_ * Vec3(a.color);
    if (base_texture_) color *= base_texture_.color(a.uv);
    return glm::min(color, Vec3(1.0f));  // above 1 would create energy
  }
  Bsdf bsdf(const Attributes& a) const;
  Vec3 emission(const Attributes& a) const;
  EmissionParts emission_parts() const {
    return {emission_, emission_texture_ ? &emission_texture_ : nullptr, false};
  }
  const Alpha& alpha() const { return alpha_; }
  const NormalMap* normal_map() const { return normal_map_ ? &normal_map_ : nullptr; }
  Layers layers() const {
    if (extra_) return Layers::kGeneral;
    return reflects_ ? Layers::kGgx : Layers::kLambert;
  }
  bool is_glass() const { return extra_ && extra_->transmits() && metallic_ < 1.0f; }
  bool is_emissive() const { return max_component(emission_) > 0.0f; }
  bool double_sided() const { return double_sided_; }
  void prefetch(const Attributes& a) const {
    if (base_texture_) base_texture_.prefetch(a.uv);
    if (metallic_roughness_texture_) metallic_roughness_texture_.prefetch(a.uv);
    if (normal_map_) normal_map_.prefetch(a);
  }
  bool reads_uv(uint32_t set) const {
    return base_texture_.reads_uv(set) || metallic_roughness_texture_.reads_uv(set) ||
           emission_texture_.reads_uv(set) || normal_map_.reads_uv(set) || (extra_ && extra_->reads_uv(set));
  }

 private:
  Vec3 base_color_{1.0f};
  float metallic_ = 1.0f, roughness_ = 1.0f;
  Vec3 dielectric_f0_{0.04f};  // before the weight
  float specular_ = 1.0f;      // weight of the dielectric layer
  bool reflects_ = true;       // whether there is a GGX layer
  Vec3 emission_{0.0f};
  TextureSampler base_texture_, metallic_roughness_texture_, emission_texture_;
  Alpha alpha_;
  NormalMap normal_map_;
  bool double_sided_ = false;
  std::shared_ptr<const ExtraLayers> extra_;
  std::optional<KeptLayers> kept_;  // empty if the layers vary
};

}  // namespace kiln

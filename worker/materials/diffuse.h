// What engines' lightmappers see of a metallic-roughness material (`--materials diffuse`): a Lambert surface
// of base colour x (1 - metallic), with emission. What it transmits counts as not covered, as alpha does.
#pragma once

#include "worker/materials/alpha.h"
#include "worker/materials/bsdf.h"
#include "worker/materials/normal_map.h"

namespace kiln {

class Diffuse {
 public:
  static constexpr std::string_view kType = "diffuse";
  static Diffuse parse(RecordReader& r, const Scene& scene);
  Vec3 albedo(const Attributes& a) const;
  Bsdf bsdf(const Attributes& a) const {
    Bsdf b;
    b.diffuse = albedo(a);
    return b;
  }
  Vec3 emission(const Attributes& a) const {
    return emission_texture_ ? emission_ * emission_texture_.color(a.uv) : emission_;
  }
  EmissionParts emission_parts() const {
    return {emission_, emission_texture_ ? &emission_texture_ : nullptr, false};
  }
  const Alpha& alpha() const { return alpha_; }
  const NormalMap* normal_map() const { return nullptr; }
  Layers layers() const { return Layers::kLambert; }
  bool is_glass() const { return false; }
  bool is_emissive() const { return max_component(emission_) > 0.0f; }
  bool double_sided() const { return double_sided_; }
  void prefetch(const Attributes& a) const {
    if (base_texture_) base_texture_.prefetch(a.uv);
    if (metallic_texture_) metallic_texture_.prefetch(a.uv);
  }
  bool reads_uv(uint32_t set) const {
    return base_texture_.reads_uv(set) || metallic_texture_.reads_uv(set) ||
           emission_texture_.reads_uv(set) || alpha_.reads_uv(set);
  }

 private:
  Vec3 base_color_{1.0f};
  float metallic_ = 1.0f;
  Vec3 emission_{0.0f};
  TextureSampler base_texture_, metallic_texture_, emission_texture_;
  Alpha alpha_;
  bool double_sided_ = false;
};

}  // namespace kiln

// KHR_materials_unlit: appears in its colour under any light, so in transport it emits its colour as radiance
// and reflects nothing.
#pragma once

#include "worker/materials/alpha.h"
#include "worker/materials/bsdf.h"
#include "worker/materials/normal_map.h"

namespace kiln {

class Unlit {
 public:
  static constexpr std::string_view kType = "unlit";
  static Unlit parse(RecordReader& r, const Scene& scene) {
    Unlit m;
    const Vec4 base = r.vec4("base_color", Vec4(1.0f));
    m.base_color_ = within(Vec3(base), 0.0f, 1.0f);
    m.texture_ = TextureSampler(scene, r.texture("base_color_texture"));
    m.alpha_ = Alpha(r, within(base.w, 0.0f, 1.0f), m.texture_);
    m.double_sided_ = r.number("double_sided", 0.0f) != 0.0f;
    return m;
  }
  Vec3 albedo(const Attributes&) const { return Vec3(0.0f); }
  Bsdf bsdf(const Attributes&) const { return {}; }
  Vec3 emission(const Attributes& a) const {
    const Vec3 color = base_color_ * Vec3(a.color);
    return texture_ ? color * texture_.color(a.uv) : color;
  }
  EmissionParts emission_parts() const { return {base_color_, texture_ ? &texture_ : nullptr, true}; }
  const Alpha& alpha() const { return alpha_; }
  const NormalMap* normal_map() const { return nullptr; }
  Layers layers() const { return Layers::kLambert; }
  bool is_glass() const { return false; }
  bool is_emissive() const { return max_component(base_color_) > 0.0f; }
  bool double_sided() const { return double_sided_; }
  void prefetch(const Attributes&) const {}  // bsdf() reads no texture
  bool reads_uv(uint32_t set) const { return texture_.reads_uv(set); }

 private:
  Vec3 base_color_{1.0f};
  TextureSampler texture_;
  Alpha alpha_;
  bool double_sided_ = false;
};

}  // namespace kiln

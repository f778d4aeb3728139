// KHR_materials_unlit: shows its colour whatever the light. In transport it therefore emits its colour as
// radiance and reflects nothing.
#pragma once

#include "worker/materials/attributes.h"
#include "worker/materials/bsdf.h"

namespace kiln {

class Unlit {
 public:
  static constexpr std::string_view kType = "unlit";
  static Unlit parse(RecordReader& r, const Scene& scene) {
    Unlit m;
    m.base_color_ = r.vec4("base_color", Vec4(1.0f));
    m.texture_ = TextureSampler(scene, r.texture("base_color_texture"));
    m.alpha_ = AlphaMode::parse(r);
    m.double_sided_ = r.number("double_sided", 0.0f) != 0.0f;
    return m;
  }
  Bsdf bsdf(const Attributes&) const { return {}; }
  Vec3 emission(const Attributes& a) const {
    const Vec3 color = Vec3(base_color_) * Vec3(a.color);
    return glm::max(texture_ ? color * texture_.color(a.uv) : color, Vec3(0.0f));
  }
  EmissionParts emission_parts() const { return {Vec3(base_color_), texture_ ? &texture_ : nullptr, true}; }
  float opacity(const Attributes& a) const {
    if (is_opaque()) return 1.0f;
    const float factor = base_color_.w * a.color.w;
    return alpha_.opacity(texture_ ? factor * texture_.alpha(a.uv) : factor);
  }
  bool is_opaque() const { return alpha_.mode == AlphaMode::kOpaque; }
  bool has_layers() const { return false; }
  bool is_glass() const { return false; }
  bool is_emissive() const { return max_component(Vec3(base_color_)) > 0.0f; }
  bool double_sided() const { return double_sided_; }
  void prefetch(const Attributes&) const {}  // bsdf() reads no texture
  bool reads_uv(uint32_t set) const { return texture_.reads_uv(set); }

 private:
  Vec4 base_color_{1.0f};
  TextureSampler texture_;
  AlphaMode alpha_;
  bool double_sided_ = false;
};

}  // namespace kiln

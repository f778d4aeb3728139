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
  Vec3 emission(const Attributes& a) const { return glm::max(Vec3(base(a)), Vec3(0.0f)); }
  float opacity(const Attributes& a) const { return is_opaque() ? 1.0f : alpha_.opacity(base(a).w); }
  bool is_opaque() const { return alpha_.mode == AlphaMode::kOpaque; }
  bool is_emissive() const { return max_component(Vec3(base_color_)) > 0.0f; }
  bool double_sided() const { return double_sided_; }

 private:
  Vec4 base(const Attributes& a) const {
    return texture_ ? base_color_ * a.color * texture_.sample(a.uv) : base_color_ * a.color;
  }
  Vec4 base_color_{1.0f};
  TextureSampler texture_;
  AlphaMode alpha_;
  bool double_sided_ = false;
};

}  // namespace kiln

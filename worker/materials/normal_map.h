// The normal texture of a material (glTF 2.0, 3.9.3).
#pragma once

#include "worker/materials/attributes.h"

namespace kiln {

class NormalMap {
 public:
  NormalMap() = default;
  NormalMap(RecordReader& r, const Scene& scene)
      : use_(r.texture("normal_texture")), texture_(scene, use_), scale_(r.number("normal_scale", 1.0f)) {
    if (!std::isfinite(scale_)) scale_ = 1.0f;
  }
  explicit operator bool() const { return static_cast<bool>(texture_); }
  // TEXCOORD set and linear part of the map from it to the texture, rows (m0 m1), (m3 m4).
  const TextureUse& use() const { return use_; }
  // In the tangent frame: x along increasing u, y against increasing v, z along the normal; not unit.
  Vec3 normal(const Attributes& a) const {
    const Vec3 t = texture_.color(a.uv) * 2.0f - Vec3(1.0f);
    return {t.x * scale_, t.y * scale_, t.z};
  }
  void prefetch(const Attributes& a) const { texture_.prefetch(a.uv); }
  bool reads_uv(uint32_t set) const { return texture_.reads_uv(set); }

 private:
  TextureUse use_;
  TextureSampler texture_;
  float scale_ = 1.0f;
};

}  // namespace kiln

// Bilinear texture lookup in linear light.
#pragma once

#include "common/scene/scene.h"

namespace kiln {

class TextureSampler {
 public:
  TextureSampler() = default;
  TextureSampler(const Scene& scene, const TextureUse& use)
      : texture_(use.texture >= 0 ? &scene.textures[use.texture] : nullptr), use_(use) {}

  explicit operator bool() const { return texture_ != nullptr; }
  // RGBA; missing colour channels repeat the first, a missing alpha is 1.
  Vec4 sample(const Vec2 (&uv)[2]) const;

 private:
  Vec4 fetch(int x, int y) const;
  const Texture* texture_ = nullptr;
  TextureUse use_;
};

}  // namespace kiln

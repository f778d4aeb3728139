// Texture lookup in linear light. Colours read one texel, opacity reads four (docs/maths.md, "Textures").
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace kiln {

struct Range {
  float low, high;
};

class TextureSampler {
 public:
  TextureSampler() = default;
  TextureSampler(const Scene& scene, const TextureUse& use);

  explicit operator bool() const { return texture_ != nullptr; }
  bool reads_uv(uint32_t set) const { return texture_ && use_.uv_set == set; }
  // Colour channels; missing ones repeat the first. One of the four texels around the point, chosen in
  // proportion to its bilinear weight by a hash of the coordinates: a dither far below a texel's size with
  // the bilinear filter's mean, at a quarter of its memory traffic.
  Vec3 color(const Vec2 (&uv)[2]) const;
  // Prefetches the texel that color() will read.
  void prefetch(const Vec2 (&uv)[2]) const { __builtin_prefetch(texels_ + color_index(uv) * texel_bytes_); }
  // The alpha channel, filtered bilinearly because a cutoff is not linear; 1 if absent.
  float alpha(const Vec2 (&uv)[2]) const;
  // Extremes of the alpha channel: of the whole texture, and of all texels that alpha() may read on a
  // triangle with these coordinates at its corners; the latter is nullopt if the triangle is larger than the
  // texture.
  Range alpha_range() const;
  std::optional<Range> alpha_range(const Vec2 (&a)[2], const Vec2 (&b)[2], const Vec2 (&c)[2]) const;

  // For integrals over the image.
  const Texture& texture() const { return *texture_; }
  Vec3 texel(uint32_t x, uint32_t y) const { return color_texel(size_t{y} * texture_->width + x); }
  // The image's own coordinates (u, v) of a point, not wrapped.
  DVec2 placed(const Vec2 (&uv)[2]) const {
    const DVec2 p(uv[use_.uv_set]);
    return {use_.m[0] * p.x + use_.m[1] * p.y + use_.m[2], use_.m[3] * p.x + use_.m[4] * p.y + use_.m[5]};
  }

 private:
  struct Point {
    float x, y;  // in texels; within [0, size], wrapped already
  };
  Point place(const Vec2 (&uv)[2]) const;
  size_t color_index(const Vec2 (&uv)[2]) const;
  Vec3 color_texel(size_t index) const;
  float alpha_texel(size_t index) const;

  const Texture* texture_ = nullptr;
  const std::byte* texels_ = nullptr;
  const float* decode_ = nullptr;  // by byte; null: texels are floats
  size_t texel_bytes_ = 0;
  int width_ = 0, height_ = 0;
  TextureUse use_;
};

}  // namespace kiln

#include "worker/materials/texture_sampler.h"

#include <array>
#include <bit>
#include <cstring>

#include "common/math/sequence.h"

namespace kiln {
namespace {

struct ByteTables {
  std::array<float, 256> srgb, linear;
};
const ByteTables& byte_tables() {
  static const ByteTables tables = [] {
    ByteTables t;
    for (int i = 0; i < 256; ++i) {
      t.linear[i] = static_cast<float>(i) / 255.0f;
      t.srgb[i] = srgb_to_linear(t.linear[i]);
    }
    return t;
  }();
  return tables;
}

// floor() without the library call needed before SSE 4.1.
int floor_int(float x) {
  const int i = static_cast<int>(x);
  return i - (static_cast<float>(i) > x);
}

// Wraps a coordinate in texels into [0, size] without integer division.
float wrapped(float u, int size, Wrap mode) {
  // Far outside [-1e4, 1e4] a float no longer resolves texels, and int would overflow.
  if (!(std::abs(u) < 1e4f)) u = 0.0f;
  if (mode == Wrap::kRepeat) {
    u -= static_cast<float>(floor_int(u));
  } else if (mode == Wrap::kMirror) {
    u -= 2.0f * static_cast<float>(floor_int(0.5f * u));
    u = std::min(u, 2.0f - u);
  } else {
    u = std::clamp(u, 0.0f, 1.0f);
  }
  return u * static_cast<float>(size);
}

// Wraps a texel index that is at most one past an edge.
int edge(int i, int size, Wrap mode) {
  if (mode == Wrap::kRepeat) return i < 0 ? size - 1 : i >= size ? 0 : i;
  return std::clamp(i, 0, size - 1);
}

}  // namespace

TextureSampler::TextureSampler(const Scene& scene, const TextureUse& use) : use_(use) {
  if (use.texture < 0) return;
  texture_ = &scene.textures[use.texture];
  texels_ = texture_->texels.data();
  texel_bytes_ = texture_->texel_bytes();
  width_ = static_cast<int>(texture_->width);
  height_ = static_cast<int>(texture_->height);
  if (texture_->format == TexelFormat::kSrgb8) decode_ = byte_tables().srgb.data();
  if (texture_->format == TexelFormat::kUnorm8) decode_ = byte_tables().linear.data();
}

TextureSampler::Point TextureSampler::place(const Vec2 (&uv)[2]) const {
  const Vec2& p = uv[use_.uv_set];
  const float u = use_.m[0] * p.x + use_.m[1] * p.y + use_.m[2];
  const float v = use_.m[3] * p.x + use_.m[4] * p.y + use_.m[5];
  return {wrapped(u, width_, texture_->wrap_s), wrapped(v, height_, texture_->wrap_t)};
}

float TextureSampler::alpha_texel(size_t index) const {
  const uint32_t channels = texture_->channels;
  const size_t i = index * channels + channels - 1;
  if (decode_) return byte_tables().linear[static_cast<uint8_t>(texels_[i])];
  float a;
  std::memcpy(&a, texels_ + i * sizeof(float), sizeof a);
  return a;
}

size_t TextureSampler::color_index(const Vec2 (&uv)[2]) const {
  Point p = place(uv);
  if (!texture_->nearest) {
    const uint64_t h = mix_bits(uint64_t{std::bit_cast<uint32_t>(p.x)} << 32 | std::bit_cast<uint32_t>(p.y));
    p.x += unit_float(static_cast<uint32_t>(h >> 32)) - 0.5f;
    p.y += unit_float(static_cast<uint32_t>(h)) - 0.5f;
  }
  const int x = edge(floor_int(p.x), width_, texture_->wrap_s),
            y = edge(floor_int(p.y), height_, texture_->wrap_t);
  return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
}

Vec3 TextureSampler::color(const Vec2 (&uv)[2]) const {
  return color_texel(color_index(uv));
}

Vec3 TextureSampler::color_texel(size_t index) const {
  const std::byte* texel = texels_ + index * texel_bytes_;
  const bool gray = texture_->channels < 3;
  if (decode_) {
    const auto* t = reinterpret_cast<const uint8_t*>(texel);
    return gray ? Vec3(decode_[t[0]]) : Vec3(decode_[t[0]], decode_[t[1]], decode_[t[2]]);
  }
  float c[3];
  std::memcpy(c, texel, (gray ? 1 : 3) * sizeof(float));
  return gray ? Vec3(c[0]) : Vec3(c[0], c[1], c[2]);
}

float TextureSampler::alpha(const Vec2 (&uv)[2]) const {
  if (texture_->channels == 1 || texture_->channels == 3) return 1.0f;
  const Point p = place(uv);
  const auto at = [this](int x, int y) {
    return alpha_texel(static_cast<size_t>(edge(y, height_, texture_->wrap_t)) * static_cast<size_t>(width_) +
                       static_cast<size_t>(edge(x, width_, texture_->wrap_s)));
  };
  if (texture_->nearest) return at(floor_int(p.x), floor_int(p.y));
  const int x = floor_int(p.x - 0.5f), y = floor_int(p.y - 0.5f);
  const float a = p.x - 0.5f - static_cast<float>(x), b = p.y - 0.5f - static_cast<float>(y);
  const float top = at(x, y) * (1.0f - a) + at(x + 1, y) * a;
  const float bottom = at(x, y + 1) * (1.0f - a) + at(x + 1, y + 1) * a;
  return top * (1.0f - b) + bottom * b;
}

}  // namespace kiln

#include "worker/materials/texture_sampler.h"

#include <array>
#include <cstring>

namespace kiln {
namespace {

int wrap(int i, int size, Wrap mode) {
  switch (mode) {
    case Wrap::kClamp: return std::clamp(i, 0, size - 1);
    case Wrap::kMirror: {
      const int period = 2 * size;
      i = ((i % period) + period) % period;
      return i < size ? i : period - 1 - i;
    }
    case Wrap::kRepeat: break;
  }
  return ((i % size) + size) % size;
}

const std::array<float, 256>& srgb_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t;
    for (int i = 0; i < 256; ++i) t[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
    return t;
  }();
  return table;
}

}  // namespace

Vec4 TextureSampler::fetch(int x, int y) const {
  const Texture& t = *texture_;
  const size_t i = (size_t{static_cast<unsigned>(wrap(y, static_cast<int>(t.height), t.wrap_t))} * t.width +
                    static_cast<unsigned>(wrap(x, static_cast<int>(t.width), t.wrap_s))) *
                   t.channels;
  float c[4];
  for (uint32_t k = 0; k < t.channels; ++k) {
    if (t.format == TexelFormat::kFloat32) {
      std::memcpy(&c[k], t.texels.data() + 4 * (i + k), 4);
    } else {
      const auto byte = static_cast<uint8_t>(t.texels[i + k]);
      const bool alpha = (t.channels == 4 && k == 3) || (t.channels == 2 && k == 1);
      c[k] = t.format == TexelFormat::kSrgb8 && !alpha ? srgb_table()[byte] : static_cast<float>(byte) / 255.0f;
    }
  }
  switch (t.channels) {
    case 1: return {c[0], c[0], c[0], 1.0f};
    case 2: return {c[0], c[0], c[0], c[1]};
    case 3: return {c[0], c[1], c[2], 1.0f};
    default: return {c[0], c[1], c[2], c[3]};
  }
}

Vec4 TextureSampler::sample(const Vec2 (&uv)[2]) const {
  const Vec2& p = uv[use_.uv_set];
  float u = use_.m[0] * p.x + use_.m[1] * p.y + use_.m[2];
  float v = use_.m[3] * p.x + use_.m[4] * p.y + use_.m[5];
  // Far outside [-1e4, 1e4] float has no texel left to point at, and int would overflow.
  if (!(std::abs(u) < 1e4f)) u = 0.0f;
  if (!(std::abs(v) < 1e4f)) v = 0.0f;
  const float x = u * static_cast<float>(texture_->width), y = v * static_cast<float>(texture_->height);
  if (texture_->nearest) return fetch(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
  const float a = x - 0.5f - fx, b = y - 0.5f - fy;
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const Vec4 top = fetch(ix, iy) * (1.0f - a) + fetch(ix + 1, iy) * a;
  const Vec4 bottom = fetch(ix, iy + 1) * (1.0f - a) + fetch(ix + 1, iy + 1) * a;
  return top * (1.0f - b) + bottom * b;
}

}  // namespace kiln

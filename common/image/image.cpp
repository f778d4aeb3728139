#include "common/image/image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace kiln {

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : static_cast<float>(std::pow((double{c} + 0.055) / 1.055, 2.4));
}
float linear_to_srgb(float l) {
  l = std::clamp(l, 0.0f, 1.0f);
  return l <= 0.0031308f ? 12.92f * l : static_cast<float>(1.055 * std::pow(double{l}, 1 / 2.4) - 0.055);
}

namespace {

bool is_srgb_channel(const Texture& t, uint32_t c) {
  return t.format == TexelFormat::kSrgb8 && !((t.channels == 4 && c == 3) || (t.channels == 2 && c == 1));
}

Texture halve(const Texture& in) {
  static const std::array<float, 256> decode = [] {
    std::array<float, 256> table;
    for (int i = 0; i < 256; ++i) table[i] = srgb_to_linear(i / 255.0f);
    return table;
  }();
  Texture out = in;
  out.width = std::max(1u, (in.width + 1) / 2);
  out.height = std::max(1u, (in.height + 1) / 2);
  out.texels.assign(out.width * size_t{out.height} * in.texel_bytes(), std::byte{0});
  const auto* bytes = reinterpret_cast<const uint8_t*>(in.texels.data());
  const auto* floats = reinterpret_cast<const float*>(in.texels.data());
  for (uint32_t y = 0; y < out.height; ++y)
    for (uint32_t x = 0; x < out.width; ++x)
      for (uint32_t c = 0; c < in.channels; ++c) {
        const bool srgb = is_srgb_channel(in, c);
        float sum = 0;
        for (uint32_t k = 0; k < 4; ++k) {
          const uint32_t sx = std::min(2 * x + (k & 1), in.width - 1);
          const uint32_t sy = std::min(2 * y + (k >> 1), in.height - 1);
          const size_t i = (size_t{sy} * in.width + sx) * in.channels + c;
          sum += in.format == TexelFormat::kFloat32 ? floats[i] : srgb ? decode[bytes[i]] : bytes[i] / 255.0f;
        }
        const float mean = 0.25f * sum;
        const size_t o = (size_t{y} * out.width + x) * in.channels + c;
        if (in.format == TexelFormat::kFloat32)
          std::memcpy(out.texels.data() + 4 * o, &mean, 4);
        else
          out.texels[o] = static_cast<std::byte>(
              static_cast<uint8_t>(std::lround(255.0f * (srgb ? linear_to_srgb(mean) : mean))));
      }
  return out;
}

}  // namespace

Texture reduce_texture(Texture texture, uint32_t max_size) {
  while (std::max(texture.width, texture.height) > std::max(1u, max_size)) texture = halve(texture);
  return texture;
}

}  // namespace kiln

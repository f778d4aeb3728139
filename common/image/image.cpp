#include "common/image/image.h"

#include <algorithm>
#include <array>
#include <bit>
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

float srgb8_to_linear(uint8_t coded) {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> linear;
    for (int c = 0; c < 256; ++c)
      linear[static_cast<size_t>(c)] = srgb_to_linear(static_cast<float>(c) / 255.0f);
    return linear;
  }();
  return table[coded];
}

namespace {

// The least linear value of every byte, and the byte at the lower end of even steps of linear values, from
// which it is a byte or two to that of any value of the step.
struct Srgb8Table {
  static constexpr size_t kSteps = 4096;
  std::array<float, 256> least{};
  std::array<uint8_t, kSteps + 1> at{};
  Srgb8Table() {
    for (long byte = 1; byte < 256; ++byte) {
      uint32_t below = 0,
               from = std::bit_cast<uint32_t>(1.0f);  // floats of one sign are ordered as their bits
      while (from - below > 1) {
        const uint32_t middle = below + (from - below) / 2;
        (std::lround(255.0f * linear_to_srgb(std::bit_cast<float>(middle))) < byte ? below : from) = middle;
      }
      least[static_cast<size_t>(byte)] = std::bit_cast<float>(from);
    }
    for (size_t step = 0; step <= kSteps; ++step)
      at[step] = static_cast<uint8_t>(
          std::lround(255.0f * linear_to_srgb(static_cast<float>(step) / float{kSteps})));
  }
};

}  // namespace

uint8_t linear_to_srgb8(float linear) {
  static const Srgb8Table table;
  if (!(linear > 0)) return 0;
  const float l = std::min(linear, 1.0f);
  uint8_t byte = table.at[static_cast<size_t>(l * float{Srgb8Table::kSteps})];
  while (byte < 255 && l >= table.least[byte + 1u]) ++byte;
  return byte;
}

namespace {

bool is_srgb_channel(const Texture& t, uint32_t c) {
  return t.format == TexelFormat::kSrgb8 && !((t.channels == 4 && c == 3) || (t.channels == 2 && c == 1));
}

float decoded(const Texture& t, size_t i, bool srgb) {
  if (t.format == TexelFormat::kFloat32) {
    float value;
    std::memcpy(&value, t.texels.data() + 4 * i, 4);
    return value;
  }
  const auto byte = static_cast<uint8_t>(t.texels[i]);
  return srgb ? srgb8_to_linear(byte) : static_cast<float>(byte) / 255.0f;
}

void encode(Texture& t, size_t i, bool srgb, float value) {
  if (t.format == TexelFormat::kFloat32)
    std::memcpy(t.texels.data() + 4 * i, &value, 4);
  else
    t.texels[i] = static_cast<std::byte>(srgb ? linear_to_srgb8(value)
                                              : static_cast<uint8_t>(std::lround(255.0f * value)));
}

// Resampling a row of `in` cells to `out`: the input cells that output cell i covers, and the share of each.
struct Span {
  uint32_t first, last;
  double begin, end;
  Span(uint32_t i, uint32_t in, uint32_t out)
      : begin(static_cast<double>(i) * in / out), end(static_cast<double>(i + 1) * in / out) {
    first = static_cast<uint32_t>(begin);
    last = std::min(in - 1, static_cast<uint32_t>(std::ceil(end)) - 1);
  }
  float share(uint32_t cell) const {
    return static_cast<float>((std::min(end, cell + 1.0) - std::max(begin, cell + 0.0)) / (end - begin));
  }
};

Texture box_filtered(const Texture& in, uint32_t width, uint32_t height) {
  Texture out = in;
  out.width = width;
  out.height = height;
  out.texels.assign(size_t{width} * height * in.texel_bytes(), std::byte{0});
  std::vector<float> sums(size_t{width} * in.channels);
  for (uint32_t y = 0; y < height; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0f);
    const Span rows(y, in.height, height);
    for (uint32_t sy = rows.first; sy <= rows.last; ++sy)
      for (uint32_t x = 0; x < width; ++x) {
        const Span columns(x, in.width, width);
        for (uint32_t sx = columns.first; sx <= columns.last; ++sx) {
          const float weight = rows.share(sy) * columns.share(sx);
          for (uint32_t c = 0; c < in.channels; ++c)
            sums[size_t{x} * in.channels + c] +=
                weight * decoded(in, (size_t{sy} * in.width + sx) * in.channels + c, is_srgb_channel(in, c));
        }
      }
    for (size_t i = 0; i < sums.size(); ++i)
      encode(out, y * sums.size() + i, is_srgb_channel(in, static_cast<uint32_t>(i % in.channels)), sums[i]);
  }
  return out;
}

}  // namespace

Texture reduce_texture(Texture texture, uint32_t max_size) {
  uint32_t width = texture.width, height = texture.height;
  while (std::max(width, height) > std::max(1u, max_size)) {
    width = std::max(1u, (width + 1) / 2);
    height = std::max(1u, (height + 1) / 2);
  }
  if (width == texture.width && height == texture.height) return texture;
  return box_filtered(texture, width, height);
}

}  // namespace kiln

// Images in memory: named float planes, and packed texels of textures.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/check.h"

namespace kiln {

// Named float planes of one size; row 0 is v = 0. After accumulation everything is one of these.
struct Planes {
  uint32_t width = 0, height = 0;
  std::vector<std::string> names;
  std::vector<std::vector<float>> data;  // data[i].size() == width * height

  std::vector<float>& add(std::string name) {
    names.push_back(std::move(name));
    return data.emplace_back(size_t{width} * height, 0.0f);
  }
  size_t index(const std::string& name) const {
    for (size_t i = 0; i < names.size(); ++i)
      if (names[i] == name) return i;
    KILN_CHECK(!"plane exists");
    return 0;
  }
  const std::vector<float>& plane(const std::string& name) const { return data[index(name)]; }
  std::vector<float>& plane(const std::string& name) { return data[index(name)]; }
};

enum class TexelFormat : uint32_t { kUnorm8 = 0, kSrgb8 = 1, kFloat32 = 2 };
enum class Wrap : uint32_t { kRepeat = 0, kClamp = 1, kMirror = 2 };

// Interleaved texels, 1 to 4 channels. In kSrgb8 the first three channels are sRGB-coded and a fourth
// (or the second of two) is linear.
struct Texture {
  std::string name;
  uint32_t width = 0, height = 0, channels = 0;
  TexelFormat format = TexelFormat::kUnorm8;
  Wrap wrap_s = Wrap::kRepeat, wrap_t = Wrap::kRepeat;
  bool nearest = false;
  std::vector<std::byte> texels;  // rows from the top of the image: v = 0 first

  size_t texel_bytes() const { return size_t{channels} * (format == TexelFormat::kFloat32 ? 4 : 1); }
};

// Halves the sizes (odd ones round up) until neither exceeds max_size; every texel is the mean, in linear
// light, of the part of the image that it covers. The mean is kept up to one rounding.
Texture reduce_texture(Texture texture, uint32_t max_size);

float srgb_to_linear(float coded);   // IEC 61966-2-1
float linear_to_srgb(float linear);  // values are clamped to [0, 1]
// The same for bytes, by tables.
float srgb8_to_linear(uint8_t coded);
uint8_t linear_to_srgb8(float linear);  // to the nearest; what is not a number becomes 0

}  // namespace kiln

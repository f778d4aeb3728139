#include "coordinator/output/textures/pixel_codes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/image/image.h"

namespace kiln {
namespace {

float largest(const float rgb[3]) {
  return std::max({rgb[0], rgb[1], rgb[2]});
}

uint8_t to_byte(double c) {
  return static_cast<uint8_t>(std::clamp(std::floor(255 * c + 0.5), 0.0, 255.0));
}

void pack_rgbe(const float rgb[3], uint8_t rgba[4]) {
  const float most = largest(rgb);
  if (!(most > 1e-38f)) {
    std::fill_n(rgba, 4, uint8_t{0});
    return;
  }
  int exponent = 0;
  std::frexp(most, &exponent);  // most = m x 2^exponent, m in [1/2, 1)
  if (std::floor(std::ldexp(most, 8 - exponent) + 0.5f) > 255) ++exponent;
  for (int k = 0; k < 3; ++k)
    rgba[k] = static_cast<uint8_t>(
        std::clamp(std::floor(std::ldexp(double{rgb[k]}, 8 - exponent) + 0.5), 0.0, 255.0));
  rgba[3] = static_cast<uint8_t>(std::clamp(exponent + 128, 0, 255));
}

void pack_rgbm(const float rgb[3], uint8_t rgba[4]) {
  const double most = std::sqrt(double{largest(rgb)}) / 8;
  const double a = std::max(1.0, std::ceil(255 * std::min(most, 1.0) - 1e-9));
  rgba[3] = static_cast<uint8_t>(a);
  for (int k = 0; k < 3; ++k) rgba[k] = to_byte(std::sqrt(double{rgb[k]}) / 8 * 255 / a);
}

void pack_rgbd(const float rgb[3], uint8_t rgba[4]) {
  // 1/a: chosen so that the largest channel is at most 1.
  const double most = std::max(double{largest(rgb)}, 1e-12);
  const double a = std::clamp(std::floor(255 / most), 1.0, 255.0);
  rgba[3] = static_cast<uint8_t>(a);
  for (int k = 0; k < 3; ++k) rgba[k] = to_byte(std::pow(std::min(1.0, rgb[k] * a / 255), 1 / 2.2));
}

}  // namespace

uint16_t to_half(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  const uint32_t sign = (bits >> 16) & 0x8000;
  const float magnitude = std::min(std::abs(value), 65504.0f);
  if (!(magnitude > 0)) return static_cast<uint16_t>(sign);
  if (magnitude < 6.103515625e-05f)  // a denormal half: steps of 2^-24, and nearbyint rounds to even
    return static_cast<uint16_t>(sign | static_cast<uint32_t>(std::nearbyint(magnitude * 16777216.0f)));
  const auto m = std::bit_cast<uint32_t>(magnitude);
  const uint32_t rounded = m + 0xFFF + ((m >> 13) & 1);
  return static_cast<uint16_t>(sign | std::min(0x7BFFu, (rounded - (112u << 23)) >> 13));
}

float from_half(uint16_t bits) {
  const uint32_t exponent = (bits >> 10) & 31, mantissa = bits & 1023;
  float value;
  if (exponent == 0)
    value = static_cast<float>(mantissa) / 16777216.0f;
  else if (exponent == 31)
    value = std::bit_cast<float>(0x7F800000u | (mantissa << 13));
  else
    value = std::bit_cast<float>(((exponent + 112) << 23) | (mantissa << 13));
  return bits & 0x8000 ? -value : value;
}

uint32_t to_rgb9e5(const float rgb[3]) {
  constexpr float kMax = 65408.0f;  // 511 / 512 x 2^16
  float c[3];
  for (int k = 0; k < 3; ++k) c[k] = rgb[k] > 0 ? std::min(rgb[k], kMax) : 0;  // NaN becomes 0
  const float most = largest(c);
  int exponent = -15;
  if (most > 0) exponent = std::max(-15, std::ilogb(most) + 1);
  if (std::floor(std::ldexp(double{most}, 9 - exponent) + 0.5) > 511) ++exponent;
  uint32_t bits = static_cast<uint32_t>(exponent + 15) << 27;
  for (int k = 0; k < 3; ++k)
    bits |= static_cast<uint32_t>(std::floor(std::ldexp(double{c[k]}, 9 - exponent) + 0.5)) << (9 * k);
  return bits;
}

void from_rgb9e5(uint32_t bits, float rgb[3]) {
  const int exponent = static_cast<int>(bits >> 27) - 15 - 9;
  for (int k = 0; k < 3; ++k) rgb[k] = std::ldexp(static_cast<float>((bits >> (9 * k)) & 511), exponent);
}

std::string_view unpack_name(Unpack unpack) {
  static constexpr std::string_view kNames[] = {"none", "srgb", "rgbe", "rgbm", "rgbd"};
  return kNames[static_cast<int>(unpack)];
}

float unpack_most(Unpack unpack) {
  static constexpr float kMax[] = {1, 1, 3e38f, 64, 255};
  return kMax[static_cast<int>(unpack)];
}

void pack_texel(Unpack unpack, const float rgb[3], uint8_t rgba[4]) {
  switch (unpack) {
    case Unpack::kRgbe:
      return pack_rgbe(rgb, rgba);
    case Unpack::kRgbm:
      return pack_rgbm(rgb, rgba);
    case Unpack::kRgbd:
      return pack_rgbd(rgb, rgba);
    case Unpack::kNone:
    case Unpack::kSrgb:
      for (int k = 0; k < 3; ++k)
        rgba[k] = to_byte(unpack == Unpack::kSrgb ? linear_to_srgb(rgb[k]) : rgb[k]);
      rgba[3] = 255;
  }
}

void unpack_texel(Unpack unpack, const float c[4], float rgb[3]) {
  const float exponent = unpack == Unpack::kRgbe ? std::nearbyint(255 * c[3]) : 0;
  for (int k = 0; k < 3; ++k) {
    switch (unpack) {
      case Unpack::kNone:
        rgb[k] = c[k];
        break;
      case Unpack::kSrgb:
        rgb[k] = srgb_to_linear(c[k]);
        break;
      case Unpack::kRgbe:
        rgb[k] = exponent > 0 ? std::ldexp(255 * c[k], static_cast<int>(exponent) - 136) : 0;
        break;
      case Unpack::kRgbm:
        rgb[k] = 64 * c[3] * c[3] * c[k] * c[k];
        break;
      case Unpack::kRgbd:
        rgb[k] = c[3] > 0 ? std::pow(c[k], 2.2f) / c[3] : 0;
        break;
    }
  }
}

}  // namespace kiln

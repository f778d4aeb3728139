// Codes of one texel for engines without compressed or float textures, and halves.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln {

// IEEE 754 binary16, rounded to nearest even; clamped to +-65504.
uint16_t to_half(float value);
float from_half(uint16_t bits);

// VK_FORMAT_E5B9G9R9_UFLOAT_PACK32 (EXT_texture_shared_exponent): values in [0, 65408], nearest.
uint32_t to_rgb9e5(const float rgb[3]);
void from_rgb9e5(uint32_t bits, float rgb[3]);

// How four 8-bit channels hold an HDR colour. All decode to `rgb` from c = channel / 255:
//   kNone  rgb = c
//   kSrgb  IEC 61966-2-1 of each channel
//   kRgbe  rgb = channel x 2^(255 a - 136), Ward 1991
//   kRgbm  rgb = (8 a c)^2, as PlayCanvas reads it; at most 64
//   kRgbd  rgb = c^2.2 / a, as Babylon.js reads it; at most 255
enum class Unpack : uint8_t { kNone, kSrgb, kRgbe, kRgbm, kRgbd };
std::string_view unpack_name(Unpack unpack);
float unpack_most(Unpack unpack);  // largest value

// rgb in [0, unpack_most]; rounds as each code's usual encoder does.
void pack_texel(Unpack unpack, const float rgb[3], uint8_t rgba[4]);
// c in [0, 1], as returned by a texture lookup.
void unpack_texel(Unpack unpack, const float c[4], float rgb[3]);

}  // namespace kiln

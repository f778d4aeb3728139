// The constants of BC6H, from the page "BC6H Format" of Direct3D 11's programming guide (the bit layout of
// every mode) and the Direct3D 11.3 Functional Specification. Modes are numbered as on that page, from 0.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace kiln::bc6h {

constexpr int kModes = 14;
constexpr int kPartitions = 32;
constexpr int kFirstOneRegion = 10;  // modes 10 to 13 have one region and 16 levels, the others two and 8

// `count` bits of an end point's channel, from bit `low` on.
struct Run {
  uint8_t channel, end, low, count;
};

struct Mode {
  uint8_t code, code_bits;
  bool transformed;  // end points 1 to 3 are differences to 0, modulo 2^bits
  uint8_t bits;      // of end point 0's channels
  uint8_t delta[3];  // bits of the other end points, by channel
  uint8_t run_count = 0;
  std::array<Run, 32> runs{};  // behind the code, from the block's lowest bit on

  // `layout`: as the page writes it, "gy4 rw9:0": the letter of the channel, w to z the end point, bits from
  // the last to the first.
  constexpr Mode(uint8_t code, uint8_t code_bits, bool transformed, uint8_t bits, uint8_t r, uint8_t g,
                 uint8_t b, std::string_view layout)
      : code(code), code_bits(code_bits), transformed(transformed), bits(bits), delta{r, g, b} {
    for (size_t at = 0; at < layout.size();) {
      const char letter = layout[at];
      const auto channel = static_cast<uint8_t>(letter == 'r' ? 0 : letter == 'g' ? 1 : 2);
      const auto end = static_cast<uint8_t>(layout[at + 1] - 'w');
      at += 2;
      const int last = number(layout, at);
      int first = last;
      if (at < layout.size() && layout[at] == ':') first = number(layout, ++at);
      ++at;  // the blank
      if (first <= last)
        runs[run_count++] = {channel, end, static_cast<uint8_t>(first),
                             static_cast<uint8_t>(last - first + 1)};
      else
        for (int bit = first; bit >= last; --bit)
          runs[run_count++] = {channel, end, static_cast<uint8_t>(bit), 1};
    }
  }

 private:
  static constexpr int number(std::string_view layout, size_t& at) {
    int n = 0;
    while (at < layout.size() && layout[at] >= '0' && layout[at] <= '9') n = 10 * n + (layout[at++] - '0');
    return n;
  }
};

extern const std::array<Mode, kModes> kModeTable;

// Bit i: texel i is in region 1.
inline constexpr std::array<uint16_t, kPartitions> kPartitionTable = {
    0xCCCC, 0x8888, 0xEEEE, 0xECC8, 0xC880, 0xFEEC, 0xFEC8, 0xEC80, 0xC800, 0xFFEC, 0xFE80,
    0xE800, 0xFFE8, 0xFF00, 0xFFF0, 0xF000, 0xF710, 0x008E, 0x7100, 0x08CE, 0x008C, 0x7310,
    0x3100, 0x8CCE, 0x088C, 0x3110, 0x6666, 0x366C, 0x17E8, 0x0FF0, 0x718E, 0x399C};

// The anchor texel of region 1, whose index omits its upper bit; in region 0 it is texel 0.
inline constexpr std::array<uint8_t, kPartitions> kAnchorTable = {15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
                                                                  15, 15, 15, 15, 15, 15, 2,  8,  2,  2,  8,
                                                                  8,  15, 2,  8,  2,  2,  8,  8,  2,  2};

// The second end point's weight at each level, in 64ths.
inline constexpr std::array<uint8_t, 8> kWeights8 = {0, 9, 18, 27, 37, 46, 55, 64};
inline constexpr std::array<uint8_t, 16> kWeights16 = {0,  4,  9,  13, 17, 21, 26, 30,
                                                       34, 38, 43, 47, 51, 55, 60, 64};

constexpr bool two_regions(int mode) {
  return mode < kFirstOneRegion;
}

// Expands an end point's channel to 16 bits (signed: 15 and sign), in which levels are interpolated.
constexpr int spread(int value, int bits, bool is_signed) {
  if (!is_signed) {
    if (bits >= 15 || value == 0) return value;
    return value == (1 << bits) - 1 ? 0xFFFF : ((value << 16) + 0x8000) >> bits;
  }
  if (bits >= 16 || value == 0) return value;
  const int size = value < 0 ? -value : value;
  const int wide = size >= (1 << (bits - 1)) - 1 ? 0x7FFF : ((size << 15) + 0x4000) >> (bits - 1);
  return value < 0 ? -wide : wide;
}

// Converts an interpolated channel to the half float's bits; negative values as the negated bits of the
// magnitude.
constexpr int half_step(int interpolated, bool is_signed) {
  if (!is_signed) return (interpolated * 31) >> 6;
  return interpolated < 0 ? -((-interpolated * 31) >> 5) : (interpolated * 31) >> 5;
}

}  // namespace kiln::bc6h

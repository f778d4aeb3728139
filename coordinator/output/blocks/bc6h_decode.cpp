#include <bit>
#include <limits>

#include "coordinator/output/blocks/bc6h.h"
#include "coordinator/output/blocks/bc6h_block.h"

namespace kiln {
namespace {
using namespace bc6h;

float value_of(int step) {
  const uint32_t size = static_cast<uint32_t>(step < 0 ? -step : step);
  // A half's exponent is 112 below a float's; the product is exact, of denormals too. Infinity occurs only in
  // signed blocks of 16 bits, from -32768.
  const float value =
      size < 0x7C00 ? std::bit_cast<float>(size << 13) * 0x1p112f : std::numeric_limits<float>::infinity();
  return step < 0 ? -value : value;
}

void decode(const uint8_t* bytes, BlockTexels& texels, bool is_signed) {
  const Block block = unpack(bytes, is_signed);
  for (auto& texel : texels.rgba) {
    texel[0] = texel[1] = texel[2] = 0;
    texel[3] = 1;
  }
  if (block.mode < 0) return;
  const bool two = two_regions(block.mode);
  const uint32_t regions = two ? kPartitionTable[block.partition] : 0;
  const int bits = kModeTable[block.mode].bits;
  for (int i = 0; i < 16; ++i) {
    const int first = 2 * (regions >> i & 1);
    const int weight = two ? kWeights8[block.index[i]] : kWeights16[block.index[i]];
    for (int c = 0; c < 3; ++c) {
      const int a = spread(block.ends[first][c], bits, is_signed);
      const int b = spread(block.ends[first + 1][c], bits, is_signed);
      texels.rgba[i][c] = value_of(half_step((a * (64 - weight) + b * weight + 32) >> 6, is_signed));
    }
  }
}

}  // namespace

void decode_bc6h_ufloat(const uint8_t* block, BlockTexels& texels) {
  decode(block, texels, false);
}

void decode_bc6h_sfloat(const uint8_t* block, BlockTexels& texels) {
  decode(block, texels, true);
}

}  // namespace kiln

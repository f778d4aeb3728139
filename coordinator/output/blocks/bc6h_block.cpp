#include "coordinator/output/blocks/bc6h_block.h"

#include <utility>

namespace kiln::bc6h {
namespace {

// 128 bits, the lowest first.
class Bits {
 public:
  Bits() = default;
  explicit Bits(const uint8_t* bytes) {
    for (int i = 0; i < 16; ++i) word_[i / 8] |= uint64_t{bytes[i]} << 8 * (i % 8);
  }

  uint32_t take(int count) {
    uint64_t bits = word_[at_ / 64] >> at_ % 64;
    if (at_ % 64 + count > 64) bits |= word_[1] << (64 - at_ % 64);
    at_ += count;
    return static_cast<uint32_t>(bits & ((uint64_t{1} << count) - 1));
  }

  void put(uint32_t value, int count) {
    const uint64_t bits = value & ((uint64_t{1} << count) - 1);
    word_[at_ / 64] |= bits << at_ % 64;
    if (at_ % 64 + count > 64) word_[1] |= bits >> (64 - at_ % 64);
    at_ += count;
  }

  void store(uint8_t* bytes) const {
    for (int i = 0; i < 16; ++i) bytes[i] = static_cast<uint8_t>(word_[i / 8] >> 8 * (i % 8));
  }

 private:
  uint64_t word_[2] = {};
  int at_ = 0;
};

constexpr int low_bits(int value, int bits) {
  return value & ((1 << bits) - 1);
}

constexpr int sign_extended(int value, int bits) {
  const int sign = 1 << (bits - 1);
  return (low_bits(value, bits) ^ sign) - sign;
}

// The end point that a decoder reconstructs from the lowest `delta` bits of the difference.
int rebuilt(const Mode& mode, int base, int value, int delta, bool is_signed) {
  const int sum = base + sign_extended(value - base, delta);
  return is_signed ? sign_extended(sum, mode.bits) : low_bits(sum, mode.bits);
}

int end_count(int mode) {
  return two_regions(mode) ? 4 : 2;
}

bool anchor(const Block& block, int texel) {
  return texel == 0 || (two_regions(block.mode) && texel == kAnchorTable[block.partition]);
}

int index_bits(const Block& block, int texel) {
  return (two_regions(block.mode) ? 3 : 4) - anchor(block, texel);
}

}  // namespace

bool fits(const Block& block, int base, bool is_signed) {
  const Mode& mode = kModeTable[block.mode];
  if (!mode.transformed) return true;
  for (int e = 0; e < end_count(block.mode); ++e)
    for (int c = 0; c < 3; ++c) {
      const int from = block.ends[base][c], to = block.ends[e][c], half = 1 << (mode.delta[c] - 1);
      if (to - from >= -half && to - from < half) continue;
      if (rebuilt(mode, from, to, mode.delta[c], is_signed) != to) return false;  // it may wrap
    }
  return true;
}

int settled_base(const Block& block) {
  return 2 * block.index[0] > (two_regions(block.mode) ? 7 : 15) ? 1 : 0;
}

void settle_anchors(Block& block) {
  const bool two = two_regions(block.mode);
  const uint32_t regions = two ? kPartitionTable[block.partition] : 0;
  const int top = two ? 7 : 15;
  for (uint32_t region = 0; region < (two ? 2u : 1u); ++region) {
    if (2 * block.index[region == 0 ? 0 : kAnchorTable[block.partition]] < top) continue;
    std::swap(block.ends[2 * region], block.ends[2 * region + 1]);
    for (int i = 0; i < 16; ++i)
      if ((regions >> i & 1) == region) block.index[i] = static_cast<uint8_t>(top - block.index[i]);
  }
}

void pack(const Block& block, uint8_t* bytes) {
  const Mode& mode = kModeTable[block.mode];
  Bits bits;
  bits.put(mode.code, mode.code_bits);
  int fields[4][3];
  for (int e = 0; e < 4; ++e)
    for (int c = 0; c < 3; ++c)
      fields[e][c] = block.ends[e][c] - (e > 0 && mode.transformed ? block.ends[0][c] : 0);
  for (int r = 0; r < mode.run_count; ++r) {
    const Run& run = mode.runs[r];
    bits.put(static_cast<uint32_t>(fields[run.end][run.channel]) >> run.low, run.count);
  }
  if (two_regions(block.mode)) bits.put(static_cast<uint32_t>(block.partition), 5);
  for (int i = 0; i < 16; ++i) bits.put(block.index[i], index_bits(block, i));
  bits.store(bytes);
}

Block unpack(const uint8_t* bytes, bool is_signed) {
  Bits bits(bytes);
  Block block;
  uint32_t code = bits.take(2);
  if (code > 1) code |= bits.take(3) << 2;
  block.mode = -1;
  for (int m = 0; m < kModes; ++m)
    if (kModeTable[m].code == code && (kModeTable[m].code_bits == 2) == (code < 2)) block.mode = m;
  if (block.mode < 0) return block;
  const Mode& mode = kModeTable[block.mode];
  for (int r = 0; r < mode.run_count; ++r) {
    const Run& run = mode.runs[r];
    block.ends[run.end][run.channel] |= static_cast<int>(bits.take(run.count) << run.low);
  }
  for (int c = 0; c < 3; ++c) {
    int& base = block.ends[0][c];
    if (is_signed) base = sign_extended(base, mode.bits);
    for (int e = 1; e < end_count(block.mode); ++e) {
      int& end = block.ends[e][c];
      if (mode.transformed)
        end = rebuilt(mode, base, base + end, mode.delta[c], is_signed);
      else if (is_signed)
        end = sign_extended(end, mode.bits);
    }
  }
  if (two_regions(block.mode)) block.partition = static_cast<int>(bits.take(5));
  for (int i = 0; i < 16; ++i) block.index[i] = static_cast<uint8_t>(bits.take(index_bits(block, i)));
  return block;
}

}  // namespace kiln::bc6h

// Constants of the BC7 format: modes, partitions and interpolation weights. Khronos Data Format Specification
// 1.4, chapter 21 "BPTC"; "BC7 Format" of Direct3D's documentation.
#pragma once

#include <array>
#include <cstdint>

namespace kiln {

struct Bc7Mode {
  int subsets, partition_bits, rotation_bits, selector_bits;  // selector: which indices the colours use
  int colour_bits, alpha_bits;                                // of an end point, without its lowest bit "p"
  int unique_p, shared_p;                                     // one p an end point, or one a subset
  int index_bits, index2_bits;                                // index2: of alpha, of modes 4 and 5
  bool has_p() const { return unique_p || shared_p; }
};
constexpr Bc7Mode kBc7Modes[8] = {
    {3, 4, 0, 0, 4, 0, 1, 0, 3, 0}, {2, 6, 0, 0, 6, 0, 0, 1, 3, 0}, {3, 6, 0, 0, 5, 0, 0, 0, 2, 0},
    {2, 6, 0, 0, 7, 0, 1, 0, 2, 0}, {1, 0, 2, 1, 5, 6, 0, 0, 2, 3}, {1, 0, 2, 0, 7, 8, 0, 0, 2, 2},
    {1, 0, 0, 0, 7, 7, 1, 0, 4, 0}, {2, 6, 0, 0, 5, 5, 1, 0, 2, 0},
};

struct Bc7Partition {
  std::array<uint8_t, 16> subset;  // by texel
  std::array<uint8_t, 3> anchor;   // by subset: the texel whose index omits its highest bit, which is 0
};
const std::array<Bc7Partition, 64>& bc7_partitions(int subsets);  // 1 to 3

// Weights of the second end point in 64ths.
constexpr int kBc7Weights2[4] = {0, 21, 43, 64};
constexpr int kBc7Weights3[8] = {0, 9, 18, 27, 37, 46, 55, 64};
constexpr int kBc7Weights4[16] = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};
constexpr const int* bc7_weights(int index_bits) {
  return index_bits == 4 ? kBc7Weights4 : index_bits == 3 ? kBc7Weights3 : kBc7Weights2;
}

constexpr int bc7_interpolate(int low, int high, int weight) {
  return ((64 - weight) * low + weight * high + 32) >> 6;
}
// `bits` (4 to 8) of an end point to 8: its highest bits are repeated below.
constexpr int bc7_expand(int value, int bits) {
  return (value << (8 - bits)) | (value >> (2 * bits - 8));
}

}  // namespace kiln

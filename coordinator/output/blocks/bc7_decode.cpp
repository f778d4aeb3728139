#include <algorithm>
#include <bit>

#include "coordinator/output/blocks/bc7.h"
#include "coordinator/output/blocks/bc7_tables.h"

namespace kiln {
namespace {

class BitReader {
 public:
  explicit BitReader(const uint8_t* bytes) : bytes_(bytes) {}
  int get(int bits) {
    int value = 0;
    for (int i = 0; i < bits; ++i, ++at_) value |= (bytes_[at_ / 8] >> (at_ % 8) & 1) << i;
    return value;
  }

 private:
  const uint8_t* bytes_;
  int at_ = 0;
};

struct EndPoints {
  int of[3][2][4] = {};  // by subset, end, channel; 8 bits
};

EndPoints read_end_points(BitReader& in, const Bc7Mode& mode) {
  EndPoints ends;
  for (int c = 0; c < 4; ++c)
    for (int s = 0; s < mode.subsets; ++s)
      for (int e = 0; e < 2; ++e) ends.of[s][e][c] = in.get(c < 3 ? mode.colour_bits : mode.alpha_bits);
  int p[3][2] = {};
  for (int s = 0; s < mode.subsets; ++s) {
    if (mode.shared_p) p[s][0] = p[s][1] = in.get(1);
    if (mode.unique_p)
      for (int& bit : p[s]) bit = in.get(1);
  }
  for (int s = 0; s < mode.subsets; ++s)
    for (int e = 0; e < 2; ++e)
      for (int c = 0; c < 4; ++c) {
        int bits = c < 3 ? mode.colour_bits : mode.alpha_bits;
        int& value = ends.of[s][e][c];
        if (bits == 0) {
          value = 255;
          continue;
        }
        if (mode.has_p()) value = value << 1 | p[s][e], ++bits;
        value = bc7_expand(value, bits);
      }
  return ends;
}

}  // namespace

void decode_bc7(const uint8_t* block, BlockTexels& texels) {
  const int number = std::countr_zero(block[0]);
  if (number == 8) {
    std::fill_n(texels.rgba[0], 64, 0.0f);
    return;
  }
  const Bc7Mode& mode = kBc7Modes[number];
  BitReader in(block);
  in.get(number + 1);
  const Bc7Partition& partition =
      bc7_partitions(mode.subsets)[static_cast<size_t>(in.get(mode.partition_bits))];
  const int rotation = in.get(mode.rotation_bits), selector = in.get(mode.selector_bits);
  const EndPoints ends = read_end_points(in, mode);
  int index[2][16] = {};
  for (int i = 0; i < 16; ++i) {
    const bool anchor = i == partition.anchor[partition.subset[static_cast<size_t>(i)]];
    index[0][i] = in.get(mode.index_bits - anchor);
  }
  if (mode.index2_bits)
    for (int i = 0; i < 16; ++i) index[1][i] = in.get(mode.index2_bits - (i == 0));
  // Modes 4 and 5: colours use the first indices and alpha the second, or vice versa.
  const int colour_set = selector, alpha_set = mode.index2_bits ? 1 - selector : 0;
  const int bits[2] = {mode.index_bits, mode.index2_bits};
  for (int i = 0; i < 16; ++i) {
    const auto& e = ends.of[partition.subset[static_cast<size_t>(i)]];
    int value[4];
    for (int c = 0; c < 4; ++c) {
      const int set = c < 3 ? colour_set : alpha_set;
      value[c] = bc7_interpolate(e[0][c], e[1][c], bc7_weights(bits[set])[index[set][i]]);
    }
    if (rotation) std::swap(value[3], value[rotation - 1]);
    for (int c = 0; c < 4; ++c) texels.rgba[i][c] = static_cast<float>(value[c]) / 255.0f;
  }
}

}  // namespace kiln

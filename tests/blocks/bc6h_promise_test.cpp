// What docs/encoding.md promises of smooth maps: effort normal, relMSE at most 1e-5 on texels with weight,
// none off by more than 2 % of its block's largest value, and what block-aware fill is worth.
#include "coordinator/output/blocks/blocks.h"

namespace kiln {
namespace {

constexpr uint32_t kSize = 256;

struct Map {
  std::vector<float> rgba = std::vector<float>(4 * kSize * kSize, 0.0f),
                     weight = std::vector<float>(kSize * kSize, 0.0f);
};

// Three lamps over a floor, 48 texels above it: light falls by (1 + (d/h)^2)^-2, less than 0.24 stops over a
// block. A third of the texels is nobody's and black.
Map smooth_map() {
  Map map;
  for (uint32_t y = 0; y < kSize; ++y)
    for (uint32_t x = 0; x < kSize; ++x) {
      if (x % 61 >= 50 || y % 53 >= 47) continue;
      const size_t t = size_t{y} * kSize + x;
      const float colour[3][3] = {{20, 17, 11}, {9, 12, 15}, {14, 14, 14}}, ambient[3] = {0.3f, 0.4f, 0.6f};
      for (size_t c = 0; c < 3; ++c) map.rgba[4 * t + c] = ambient[c];
      for (size_t lamp = 0; lamp < 3; ++lamp) {
        const float dx = static_cast<float>(x) - 40.0f - 90.0f * static_cast<float>(lamp),
                    dy = static_cast<float>(y) - 60.0f - 70.0f * static_cast<float>(lamp);
        const float q = 48 * 48 / (48 * 48 + dx * dx + dy * dy);
        for (size_t c = 0; c < 3; ++c) map.rgba[4 * t + c] += colour[lamp][c] * q * q;
      }
      map.rgba[4 * t + 3] = 1;
      map.weight[t] = 1;
    }
  return map;
}

struct Result {
  double rel_mse = 0, worst = 0;  // worst: of the block's largest value
};

Result measure(const Map& map, bool fill) {
  const BlockFormat& format = *find_block_format("bc6h_ufloat");
  const Bytes blocks = *encode_blocks(format, {kSize, kSize, map.rgba, map.weight},
                                      {BlockEffort::kNormal, BlockMetric::kLog, false}, fill);
  const std::vector<float> got = *decode_blocks(format, blocks, kSize, kSize);
  Result r;
  double sum = 0;
  uint64_t count = 0;
  for (uint32_t by = 0; by < kSize; by += 4)
    for (uint32_t bx = 0; bx < kSize; bx += 4) {
      double largest = 0, worst = 0;
      for (uint32_t k = 0; k < 16; ++k) {
        const size_t t = (by + k / 4) * size_t{kSize} + bx + k % 4;
        if (map.weight[t] == 0) continue;
        for (size_t c = 0; c < 3; ++c) {
          const double want = map.rgba[4 * t + c], off = std::abs(got[4 * t + c] - want);
          sum += off * off / (want * want);
          ++count;
          largest = std::max(largest, want);
          worst = std::max(worst, off);
        }
      }
      if (largest > 0) r.worst = std::max(r.worst, worst / largest);
    }
  r.rel_mse = sum / static_cast<double>(count);
  return r;
}

TEST(Bc6hPromise, SmoothMapsKeepOneInAHundredThousand) {
  const Map map = smooth_map();
  const Result filled = measure(map, true), plain = measure(map, false);
  EXPECT_LE(filled.rel_mse, 1e-5);
  EXPECT_LE(filled.worst, 0.02);
  EXPECT_GT(plain.rel_mse, 5 * filled.rel_mse);
  std::printf("relMSE %.2e, worst texel %.2f %% of its block's largest; without fill %.2e, %.1f %%\n",
              filled.rel_mse, 100 * filled.worst, plain.rel_mse, 100 * plain.worst);
}

}  // namespace
}  // namespace kiln

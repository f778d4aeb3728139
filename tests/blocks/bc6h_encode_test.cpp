#include <cmath>

#include "coordinator/output/blocks/bc6h.h"
#include "coordinator/output/blocks/bc6h_modes.h"
#include "tests/blocks/bc6h_maker.h"

namespace kiln {
namespace {
using namespace test;

constexpr BlockEffort kEfforts[] = {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest};
constexpr BlockMetric kMetrics[] = {BlockMetric::kLinear, BlockMetric::kLog, BlockMetric::kPerceptual};
constexpr int kTopHalf = 0x7BFF;

const BlockFormat& unsigned_format() {
  return *find_block_format("bc6h_ufloat");
}
const BlockFormat& signed_format() {
  return *find_block_format("bc6h_sfloat");
}

void expect_exact(const BlockFormat& format, const BlockTexels& texels, const BlockChoice& choice) {
  const BlockTexels got = round_trip(format, texels, choice);
  for (int i = 0; i < 16; ++i)
    for (int c = 0; c < 3; ++c)
      if (texels.weight[i] > 0)
        ASSERT_EQ(texels.rgba[i][c], got.rgba[i][c]) << "texel " << i << " channel " << c;
}

// 16-bit end points reach every half float: 0, denormals and 65504 too.
TEST(Bc6hEncode, SolidHalfsAreExact) {
  for (const BlockMetric metric : kMetrics)
    for (int h = 0; h <= kTopHalf; h = h < kTopHalf ? std::min(h + 5, kTopHalf) : h + 1) {
      const int g = (h * 7 + 3) % (kTopHalf + 1), b = kTopHalf - h;
      const BlockEffort effort = h % 64 ? BlockEffort::kFast : kEfforts[h / 64 % 3];
      expect_exact(unsigned_format(), solid(value_of_half(h), value_of_half(g), value_of_half(b)),
                   {effort, metric});
      expect_exact(signed_format(), solid(value_of_half(-h), value_of_half(g), value_of_half(-b)),
                   {effort, metric});
    }
}

// Four neighbouring halfs span at most 7 of the 65536 places of end points, which differences of 4 bits
// reach.
TEST(Bc6hEncode, NeighbouringHalfsAreExact) {
  std::mt19937 random(1);
  for (int round = 0; round < 3000; ++round) {
    const int h[3] = {int(random() % 0x7BF0), int(random() % 0x7BF0), int(random() % 0x7BF0)};
    BlockTexels texels = solid(0, 0, 0);
    for (auto& texel : texels.rgba) {
      const int k = random() % 4;
      for (int c = 0; c < 3; ++c) texel[c] = value_of_half(h[c] + k);
    }
    expect_exact(unsigned_format(), texels, {round % 30 ? BlockEffort::kFast : kEfforts[round / 30 % 3]});
  }
}

// One region between the least and the largest value of each channel, in the finest mode that has room:
// written here again, from the specification.
double plain_error(const BlockTexels& texels) {
  constexpr int kModesByFineness[][2] = {{16, 4}, {12, 8}, {11, 9}, {10, 10}};  // bits, of differences
  for (const auto& [bits, delta] : kModesByFineness) {
    int ends[2][3];
    bool room = true;
    for (int c = 0; c < 3; ++c) {
      double low = 1e30, high = -1e30;
      for (const auto& texel : texels.rgba) {
        low = std::min(low, (step_of(texel[c]) + 0.5) * 64 / 31);
        high = std::max(high, (step_of(texel[c]) + 0.5) * 64 / 31);
      }
      for (int e = 0; e < 2; ++e) {
        const double place = e ? high : low;
        double nearest = 1e30;
        for (int q = int(place / (1 << (16 - bits))) - 2, last = q + 4; q <= last; ++q) {
          if (q < 0 || q >= 1 << bits) continue;
          const double off = std::abs(bc6h::spread(q, bits, false) - place);
          if (off < nearest) nearest = off, ends[e][c] = q;
        }
      }
      room &= delta == bits || std::abs(ends[1][c] - ends[0][c]) < 1 << (delta - 1);
    }
    if (!room) continue;
    double sum = 0;
    for (const auto& texel : texels.rgba) {
      double least = 1e300;
      for (const int weight : bc6h::kWeights16) {
        double squares = 0;
        for (int c = 0; c < 3; ++c) {
          const int a = bc6h::spread(ends[0][c], bits, false), b = bc6h::spread(ends[1][c], bits, false);
          const double off =
              bc6h::half_step((a * (64 - weight) + b * weight + 32) >> 6, false) - step_of(texel[c]);
          squares += off * off;
        }
        least = std::min(least, squares);
      }
      sum += least;
    }
    return sum;
  }
  return 0;
}

TEST(Bc6hEncode, NeverWorseThanThePlainEncoder) {
  std::mt19937 random(2);
  double plain = 0, ours = 0;
  for (int round = 0; round < 3000; ++round) {
    const BlockTexels texels = smooth_block(random, round % 3 ? 0.3f : 4.0f, round % 2 ? 0.02f : 0.5f);
    const double bound = plain_error(texels);
    const double error =
        error_of(texels, round_trip(unsigned_format(), texels, {BlockEffort::kFast}), BlockMetric::kLog);
    EXPECT_LE(error, bound * 1.00001);  // sums of floats
    plain += bound;
    ours += error;
  }
  EXPECT_LT(ours, 0.9 * plain);
}

TEST(Bc6hEncode, EffortNeverCostsError) {
  std::mt19937 random(3);
  double sums[3][3] = {};
  for (int round = 0; round < 300; ++round) {
    const bool with_signs = round % 4 == 3;
    BlockTexels texels = smooth_block(random, round % 3 ? 0.5f : 5.0f, round % 2 ? 0.01f : 0.3f, with_signs);
    if (round % 5 == 0)
      for (float& weight : texels.weight) weight = static_cast<float>(random() % 3);
    for (const BlockMetric metric : kMetrics) {
      double last = 1e300;
      for (const BlockEffort effort : kEfforts) {
        const BlockTexels got =
            round_trip(with_signs ? signed_format() : unsigned_format(), texels, {effort, metric});
        const double error = error_of(texels, got, metric);
        EXPECT_LE(error, last * 1.00001);
        last = error;
        sums[int(metric)][int(effort)] += error;
      }
    }
  }
  for (const auto& sum : sums) {
    EXPECT_LT(sum[1], 0.9 * sum[0]);
    EXPECT_LT(sum[2], sum[1]);
  }
}

// Two nearly even colours a hundred to one apart: end points of 10 bits are off by up to 16 steps. The best
// effort lays the colours on inner levels, where many pairs of end points meet them.
TEST(Bc6hEncode, BestEffortMeetsTheColoursOfHardEdges) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> part(0.9f, 1.1f);
  double normal = 0, best = 0;
  for (int round = 0; round < 60; ++round) {
    BlockTexels texels = solid(8 * part(random), 7 * part(random), 5 * part(random));
    for (int i = 0; i < 16; ++i)
      if (i % 4 + i / 4 > 3)
        for (float& v : texels.rgba[i]) v *= 0.01f;
    normal +=
        error_of(texels, round_trip(unsigned_format(), texels, {BlockEffort::kNormal}), BlockMetric::kLog);
    best += error_of(texels, round_trip(unsigned_format(), texels, {BlockEffort::kBest}), BlockMetric::kLog);
  }
  EXPECT_LT(best, 0.4 * normal);
}

// What a metric makes small is smaller than under the others.
TEST(Bc6hEncode, EachMetricIsBestByItsOwnMeasure) {
  std::mt19937 random(4);
  double sums[3][3] = {};  // chosen, measured
  for (int round = 0; round < 200; ++round) {
    const BlockTexels texels = smooth_block(random, 6, 0.5f);
    double scale[3];
    for (const BlockMetric chosen : kMetrics) {
      const BlockTexels got = round_trip(unsigned_format(), texels, {BlockEffort::kNormal, chosen});
      for (const BlockMetric measured : kMetrics) {
        const double error = error_of(texels, got, measured);
        if (chosen == kMetrics[0]) scale[int(measured)] = error;  // each block counts alike
        sums[int(chosen)][int(measured)] += error / scale[int(measured)];
      }
    }
  }
  for (int measured = 0; measured < 3; ++measured)
    for (int chosen = 0; chosen < 3; ++chosen)
      if (chosen != measured)
        EXPECT_LT(sums[measured][measured], sums[chosen][measured]) << chosen << measured;
}

// 16 texels on a line of `span` steps. Levels lie at most 5/64 of it apart; its end points are off by half a
// cell; interpolation, the step and the end points' rounding by one step. A plain encoder's error is no more
// than that, and none of ours has a larger sum.
TEST(Bc6hEncode, TexelsOnALineKeepTheBoundOfLevels) {
  std::mt19937 random(5);
  for (int round = 0; round < 2000; ++round) {
    const int span = 1 << (2 + round % 11);  // steps; 1024 of them are a stop
    BlockTexels texels = solid(0, 0, 0);
    int base[3], slope[3], largest = 0;
    for (int c = 0; c < 3; ++c) {
      base[c] = 2000 + static_cast<int>(random() % 20000);
      slope[c] = static_cast<int>(random() % (span + 1));
      largest = std::max(largest, slope[c]);
    }
    double at[16], low = 1, high = 0;
    for (double& t : at) {
      t = random() * 0x1p-32;
      low = std::min(low, t);
      high = std::max(high, t);
    }
    for (int i = 0; i < 16; ++i)
      for (int c = 0; c < 3; ++c)
        texels.rgba[i][c] = value_of_half(base[c] + static_cast<int>(std::lround(at[i] * slope[c])));
    // Cells of 12, 11 and 10 bits, by the room for differences (in places, 64/31 of a step).
    const double places = largest * 64.0 / 31 + 2;
    const double cell = places < 6 ? 1 : places < 126 * 16 ? 16 : places < 254 * 32 ? 32 : 64;
    double bound = 0;
    for (int c = 0; c < 3; ++c) {
      const double off = 2.5 / 64 * (high - low) * slope[c] + (0.5 * cell + 1) * 31 / 64 + 1;
      bound += off * off;
    }
    for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal}) {
      const double error =
          error_of(texels, round_trip(unsigned_format(), texels, {effort}), BlockMetric::kLog);
      EXPECT_LE(error, 16 * bound) << "span " << span;
    }
  }
}

// A texel without weight may be anything, and takes nothing from the others.
TEST(Bc6hEncode, WeightlessTexelsCostNothing) {
  std::mt19937 random(6);
  for (int round = 0; round < 300; ++round) {
    BlockTexels texels =
        solid(value_of_half(int(random() % 0x7BFF)), value_of_half(int(random() % 0x7BFF)), 0.25f);
    for (int i = 0; i < 16; ++i) {
      if (i == round % 16 || random() % 3 == 0) continue;
      texels.weight[i] = 0;
      for (int c = 0; c < 3; ++c) texels.rgba[i][c] = value_of_half(int(random() % 0x7BFF));
    }
    for (const BlockMetric metric : kMetrics)
      expect_exact(unsigned_format(), texels,
                   {round % 20 ? BlockEffort::kNormal : BlockEffort::kBest, metric});
  }
}

TEST(Bc6hEncode, HeavyTexelsComeOutBetter) {
  std::mt19937 random(7);
  double light = 0, heavy = 0;
  for (int round = 0; round < 200; ++round) {
    BlockTexels texels = smooth_block(random, 3, 1);
    const auto of_first = [&] {
      BlockTexels got = round_trip(unsigned_format(), texels, {});
      double sum = 0;
      for (int i = 0; i < 4; ++i)
        for (int c = 0; c < 3; ++c) sum += std::pow(step_of(got.rgba[i][c]) - step_of(texels.rgba[i][c]), 2);
      return sum;
    };
    light += of_first();
    for (int i = 0; i < 4; ++i) texels.weight[i] = 30;
    heavy += of_first();
  }
  EXPECT_LT(heavy, 0.5 * light);
}

}  // namespace
}  // namespace kiln

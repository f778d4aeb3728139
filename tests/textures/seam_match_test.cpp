// Blocks on both sides of a seam.
#include "coordinator/output/textures/seam_match.h"

#include <numeric>

#include "tests/atlas/shapes.h"

namespace kiln::test {
namespace {

// Two strips of blocks whose facing rows hold the same light, but whose inner texels differ, so that blocks
// decode the rows differently.
struct Strips {
  static constexpr uint32_t kWidth = 64, kHeight = 8;
  std::vector<float> target = std::vector<float>(4 * kWidth * kHeight),
                     weight = std::vector<float>(kWidth * kHeight, 1);
  std::vector<SeamEquation> equations;
  std::vector<Bytes> pages;
  std::vector<float> decoded;
  std::vector<float> norm = std::vector<float>(kWidth * kHeight);
  BlockChoice choice{BlockEffort::kFast, BlockMetric::kLog, false};

  Strips() {
    Random random(7);
    for (uint32_t y = 0; y < kHeight; ++y)
      for (uint32_t x = 0; x < kWidth; ++x)
        for (uint32_t c = 0; c < 3; ++c) {
          const double along = 1 + 0.5 * std::sin(x * 0.3) + 0.1 * c;
          const bool seam = y == 3 || y == 4;
          const double inner = y < 4 ? 4 * random.next() : 0.2 + random.next();
          target[4 * (y * kWidth + x) + c] = static_cast<float>(seam ? along : along * inner);
        }
    for (size_t t = 0; t < norm.size(); ++t) {
      const float l = 0.2126f * target[4 * t] + 0.7152f * target[4 * t + 1] + 0.0722f * target[4 * t + 2];
      norm[t] = 1 / (l * l);
    }
    for (uint32_t x = 0; x + 1 < kWidth; ++x) {
      SeamEquation e;
      for (uint32_t s = 0; s < 2; ++s) {
        e.side[s].count = 2;
        e.side[s].texel = {(3 + s) * kWidth + x, (3 + s) * kWidth + x + 1, 0, 0};
        e.side[s].weight = {0.5f, 0.5f, 0, 0};
      }
      e.texels = 1;
      equations.push_back(e);
    }
  }
  SeamMatch run(const BlockFormat& format) {
    pages = {*encode_blocks(format, {kWidth, kHeight, target, weight}, choice)};
    decoded = *decode_blocks(format, pages[0], kWidth, kHeight);
    SeamBlocks in;
    in.format = &format;
    in.choice = choice;
    in.width = kWidth;
    in.page_height = kHeight;
    in.target = target;
    in.weight = weight;
    in.norm = norm;
    in.pages = &pages;
    in.decoded = &decoded;
    return match_seams(in, equations);
  }
};

TEST(SeamMatch, StepsFallAndTheBytesAreWhatIsDecoded) {
  Strips s;
  const BlockFormat& format = *find_block_format("bc6h_ufloat");
  const SeamMatch m = s.run(format);
  EXPECT_EQ(m.equations, s.equations.size());
  EXPECT_EQ(m.blocks, 32u);
  EXPECT_GT(m.changed, 0u);
  EXPECT_LT(m.rms_after, 0.7 * m.rms_before);
  EXPECT_LE(m.largest_after, m.largest_before);
  EXPECT_EQ(*decode_blocks(format, s.pages[0], Strips::kWidth, Strips::kHeight), s.decoded);
}

TEST(SeamMatch, WithoutSeamsNothingChanges) {
  Strips s;
  s.equations.clear();
  const BlockFormat& format = *find_block_format("bc6h_ufloat");
  const Bytes before =
      *encode_blocks(format, {Strips::kWidth, Strips::kHeight, s.target, s.weight}, s.choice);
  const SeamMatch m = s.run(format);
  EXPECT_EQ(m.changed, 0u);
  EXPECT_EQ(s.pages[0], before);
}

// A block is kept only if seams and texels together are better: the error of the texels may not run away.
TEST(SeamMatch, TexelsPayLittle) {
  Strips s;
  const BlockFormat& format = *find_block_format("bc6h_ufloat");
  const auto error = [&](const std::vector<float>& decoded) {
    double sum = 0;
    for (size_t t = 0; t < s.weight.size(); ++t) {
      for (size_t c = 0; c < 3; ++c) {
        const double d = decoded[4 * t + c] - s.target[4 * t + c];
        sum += s.norm[t] * d * d;
      }
    }
    return sum;
  };
  const std::vector<float> before = *decode_blocks(
      format, *encode_blocks(format, {Strips::kWidth, Strips::kHeight, s.target, s.weight}, s.choice),
      Strips::kWidth, Strips::kHeight);
  const SeamMatch m = s.run(format);
  // The sum that falls is 4 x steps^2 + errors^2; three channels, steps one texel long.
  const double steps_before = 3 * m.rms_before * m.rms_before * m.equations,
               steps_after = 3 * m.rms_after * m.rms_after * m.equations;
  EXPECT_LE(4 * steps_after + error(s.decoded), (4 * steps_before + error(before)) * (1 + 1e-9));
}

// Seams of no length count nothing: a block may change only to what is better for its texels.
TEST(SeamMatch, WithoutLengthTexelsDecide) {
  Strips s;
  for (SeamEquation& e : s.equations) e.texels = 1e-9f;
  const BlockFormat& format = *find_block_format("bc6h_ufloat");
  const auto error = [&](const std::vector<float>& decoded, size_t block) {
    double sum = 0;
    for (size_t k = 0; k < 16; ++k) {
      const size_t t = (4 * (block / 16) + k / 4) * Strips::kWidth + 4 * (block % 16) + k % 4;
      for (size_t c = 0; c < 3; ++c) {
        const double d = decoded[4 * t + c] - s.target[4 * t + c];
        sum += s.norm[t] * d * d;
      }
    }
    return sum;
  };
  const std::vector<float> before = *decode_blocks(
      format, *encode_blocks(format, {Strips::kWidth, Strips::kHeight, s.target, s.weight}, s.choice),
      Strips::kWidth, Strips::kHeight);
  s.run(format);
  for (size_t block = 0; block < 32; ++block)
    EXPECT_LE(error(s.decoded, block), error(before, block) * (1 + 1e-6)) << block;
}

}  // namespace
}  // namespace kiln::test

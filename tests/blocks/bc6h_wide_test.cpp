// The encoder as the loader picked it (AVX2 where there is such a processor) writes what the plain one
// writes.
#include "coordinator/output/blocks/bc6h.h"
#include "tests/blocks/bc6h_maker.h"

namespace kiln_plain {
void encode_bc6h_ufloat(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
void encode_bc6h_sfloat(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
}  // namespace kiln_plain

namespace kiln {
namespace {
using namespace test;

using RawBlock = std::array<uint8_t, 16>;

RawBlock wide(const BlockTexels& texels, const BlockChoice& choice, bool is_signed) {
  RawBlock block;
  (is_signed ? encode_bc6h_sfloat : encode_bc6h_ufloat)(texels, choice, block.data());
  return block;
}

// The plain build's types are the same under another name.
RawBlock plain(const BlockTexels& texels, const BlockChoice& choice, bool is_signed) {
  RawBlock block;
  (is_signed ? kiln_plain::encode_bc6h_sfloat : kiln_plain::encode_bc6h_ufloat)(
      reinterpret_cast<const kiln_plain::BlockTexels&>(texels),
      reinterpret_cast<const kiln_plain::BlockChoice&>(choice), block.data());
  return block;
}

TEST(Bc6hEncode, TheSameBytesForAnyProcessor) {
  std::mt19937 random(21);
  for (int round = 0; round < 400; ++round) {
    const bool is_signed = round % 2;
    const BlockTexels texels =
        smooth_block(random, round % 3 ? 0.5f : 6.0f, round % 5 ? 0.02f : 0.6f, is_signed && round % 4 == 1);
    for (const BlockMetric metric : {BlockMetric::kLinear, BlockMetric::kLog, BlockMetric::kPerceptual})
      for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest}) {
        if (effort == BlockEffort::kBest && round % 8) continue;
        EXPECT_EQ(wide(texels, {effort, metric}, is_signed), plain(texels, {effort, metric}, is_signed));
      }
  }
}

}  // namespace
}  // namespace kiln

// As bc7_wide_test.cpp: the encoders write the same with and without AVX2.
#include <array>

#include "coordinator/output/blocks/bc5.h"
#include "tests/blocks/bc4_samples.h"

namespace kiln_plain {
void encode_bc5(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
void encode_bc5_snorm(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
}  // namespace kiln_plain

namespace kiln {
namespace {

TEST(Bc4Encode, TheSameBytesForAnyProcessor) {
  std::mt19937 random(21);
  for (int round = 0; round < 300; ++round)
    for (const bool is_signed : {false, true})
      for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest}) {
        if (effort == BlockEffort::kBest && round % 8) continue;
        const BlockTexels texels =
            test::channel_block(test::kSamples[round % 6], is_signed, round % 4 == 0, random);
        const BlockChoice choice{effort, BlockMetric::kLinear, false};
        // The plain build's types are the same under another name.
        const auto& plain_texels = reinterpret_cast<const kiln_plain::BlockTexels&>(texels);
        const auto& plain_choice = reinterpret_cast<const kiln_plain::BlockChoice&>(choice);
        std::array<uint8_t, 16> wide{}, plain{};
        (is_signed ? encode_bc5_snorm : encode_bc5)(texels, choice, wide.data());
        (is_signed ? kiln_plain::encode_bc5_snorm : kiln_plain::encode_bc5)(plain_texels, plain_choice,
                                                                            plain.data());
        EXPECT_EQ(wide, plain) << round;
      }
}

}  // namespace
}  // namespace kiln

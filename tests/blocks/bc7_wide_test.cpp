// The encoders as the loader picked them (AVX2 where there is such a processor) write what the plain ones
// write.
#include <array>

#include "coordinator/output/blocks/bc1.h"
#include "coordinator/output/blocks/bc7.h"
#include "tests/blocks/samples.h"

namespace kiln_plain {
void encode_bc1(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
void encode_bc7(const struct BlockTexels& texels, const struct BlockChoice& choice, uint8_t* block);
}  // namespace kiln_plain

namespace kiln {
namespace {

TEST(Bc7Encode, TheSameBytesForAnyProcessor) {
  std::mt19937 random(21);
  for (int round = 0; round < 300; ++round) {
    BlockTexels texels = test::sample_block(test::kSamples[round % 6], random);
    if (round % 4 == 0)
      for (float& weight : texels.weight) weight = static_cast<float>(random() % 100);
    for (const BlockMetric metric : {BlockMetric::kLinear, BlockMetric::kPerceptual})
      for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest}) {
        if (effort == BlockEffort::kBest && round % 8) continue;
        const BlockChoice choice{effort, metric, round % 3 == 0};
        // The plain build's types are the same under another name.
        const auto& plain_texels = reinterpret_cast<const kiln_plain::BlockTexels&>(texels);
        const auto& plain_choice = reinterpret_cast<const kiln_plain::BlockChoice&>(choice);
        std::array<uint8_t, 16> wide{}, plain{};
        encode_bc7(texels, choice, wide.data());
        kiln_plain::encode_bc7(plain_texels, plain_choice, plain.data());
        EXPECT_EQ(wide, plain) << round;
        encode_bc1(texels, choice, wide.data());
        kiln_plain::encode_bc1(plain_texels, plain_choice, plain.data());
        EXPECT_EQ(wide, plain) << round;
      }
  }
}

}  // namespace
}  // namespace kiln

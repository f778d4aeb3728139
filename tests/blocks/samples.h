// Blocks for tests of encoders.
#pragma once

#include <random>

#include "coordinator/output/blocks/blocks.h"

namespace kiln::test {

enum class Sample { kNoise, kGradient, kTwoGradients, kEdge, kChannels, kSmooth };
constexpr Sample kSamples[] = {Sample::kNoise, Sample::kGradient, Sample::kTwoGradients,
                               Sample::kEdge,  Sample::kChannels, Sample::kSmooth};

// RGBA in [0, 1], weights 1.
BlockTexels sample_block(Sample sample, std::mt19937& random);

// Sum of the weighted squares of differences in the first `channels`, in 255ths.
double squared_error(const BlockTexels& a, const BlockTexels& b, int channels);

BlockTexels round_trip(const BlockFormat& format, const BlockTexels& texels, const BlockChoice& choice);

}  // namespace kiln::test

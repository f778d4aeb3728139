// The slow truth about one channel in eight bytes: every pair of ends, by the letter of the specification.
#pragma once

#include "tests/blocks/samples.h"

namespace kiln::test {

// How far two root mean squares may be apart, in steps of the ends, that the encoder's single precision takes
// for equal; derived at kSlack in bc4_channel.cpp.
constexpr double kChannelRounding = 4e-4;

// One channel of a block in steps from the bottom of the range (255ths; 127ths of blocks with sign).
struct ChannelTruth {
  double v[16], weight[16], total = 0;
  int bottom, top;  // 0, 255 or -127, 127
};
ChannelTruth channel_truth(const BlockTexels& texels, int channel, bool is_signed);

// The eight values of ends `a` and `b`, in steps.
void specified_values(const ChannelTruth& c, int a, int b, double (&value)[8]);

// Root of the weighted mean square, in steps: with the nearest of the values of `a` and `b`; of `decoded`;
// the least of all ends; of the least and largest value rounded, as plain encoders do.
double rms_of_ends(const ChannelTruth& c, int a, int b);
double rms_of(const ChannelTruth& c, const BlockTexels& decoded, int channel);
double least_rms(const ChannelTruth& c);
double plain_rms(const ChannelTruth& c);

// `sample` as red and green, and among them blocks that reach 0 and 1; with sign from [-1, 1]. Weights of 0,
// 1/3, 2/3 and 1 if `weighted`.
BlockTexels channel_block(Sample sample, bool is_signed, bool weighted, std::mt19937& random);

}  // namespace kiln::test

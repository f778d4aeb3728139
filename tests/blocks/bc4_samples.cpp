#include "tests/blocks/bc4_samples.h"

#include <algorithm>
#include <cmath>

namespace kiln::test {

ChannelTruth channel_truth(const BlockTexels& texels, int channel, bool is_signed) {
  ChannelTruth c;
  c.bottom = is_signed ? -127 : 0;
  c.top = is_signed ? 127 : 255;
  for (int i = 0; i < 16; ++i) {
    c.v[i] = c.top * double{texels.rgba[i][channel]};
    c.weight[i] = texels.weight[i];
    c.total += c.weight[i];
  }
  return c;
}

void specified_values(const ChannelTruth& c, int a, int b, double (&value)[8]) {
  value[0] = a, value[1] = b;
  if (a > b) {
    for (int k = 1; k < 7; ++k) value[k + 1] = ((7 - k) * a + k * b) / 7.0;
    return;
  }
  for (int k = 1; k < 5; ++k) value[k + 1] = ((5 - k) * a + k * b) / 5.0;
  value[6] = c.bottom, value[7] = c.top;
}

double rms_of_ends(const ChannelTruth& c, int a, int b) {
  double value[8], sum = 0;
  specified_values(c, a, b, value);
  for (int i = 0; i < 16; ++i) {
    double least = 1e30;
    for (const double v : value) least = std::min(least, (v - c.v[i]) * (v - c.v[i]));
    sum += c.weight[i] * least;
  }
  return std::sqrt(sum / c.total);
}

double rms_of(const ChannelTruth& c, const BlockTexels& decoded, int channel) {
  double sum = 0;
  for (int i = 0; i < 16; ++i)
    sum += c.weight[i] * std::pow(c.top * double{decoded.rgba[i][channel]} - c.v[i], 2);
  return std::sqrt(sum / c.total);
}

double least_rms(const ChannelTruth& c) {
  double least = 1e30;
  for (int a = c.bottom; a <= c.top; ++a)
    for (int b = c.bottom; b <= c.top; ++b) least = std::min(least, rms_of_ends(c, a, b));
  return least;
}

double plain_rms(const ChannelTruth& c) {
  double low = c.top, high = c.bottom;
  for (int i = 0; i < 16; ++i)
    if (c.weight[i] > 0) low = std::min(low, c.v[i]), high = std::max(high, c.v[i]);
  return rms_of_ends(c, static_cast<int>(std::floor(high + 0.5)), static_cast<int>(std::floor(low + 0.5)));
}

BlockTexels channel_block(Sample sample, bool is_signed, bool weighted, std::mt19937& random) {
  BlockTexels t = sample_block(sample, random);
  const bool reaches = random() % 3 == 0;
  for (int i = 0; i < 16; ++i) {
    if (weighted) t.weight[i] = static_cast<float>(random() % 4) / 3;
    for (float& v : t.rgba[i]) {
      if (reaches) v = std::clamp(2 * v - 0.5f, 0.0f, 1.0f);
      if (is_signed) v = 2 * v - 1;
    }
  }
  t.weight[5] = 1;
  return t;
}

}  // namespace kiln::test

#include "tests/blocks/samples.h"

#include <algorithm>

namespace kiln::test {
namespace {

float unit(std::mt19937& random) {
  return static_cast<float>(random() >> 8) / 16777216.0f;
}

}  // namespace

BlockTexels sample_block(Sample sample, std::mt19937& random) {
  float a[4][4], angle[2];  // up to four colours, and a direction
  for (auto& colour : a)
    for (float& v : colour) v = unit(random);
  for (float& v : angle) v = 2 * unit(random) - 1;
  BlockTexels t;
  for (int i = 0; i < 16; ++i) {
    t.weight[i] = 1;
    const float x = static_cast<float>(i % 4) / 3 - 0.5f, y = static_cast<float>(i / 4) / 3 - 0.5f;
    const float along = std::clamp(0.5f + angle[0] * x + angle[1] * y, 0.0f, 1.0f);
    const bool far = angle[0] * x + angle[1] * y > 0;
    for (int c = 0; c < 4; ++c) {
      float v = 0;
      if (sample == Sample::kNoise) v = unit(random);
      if (sample == Sample::kGradient) v = a[0][c] + along * (a[1][c] - a[0][c]);
      if (sample == Sample::kTwoGradients)
        v = far ? a[0][c] + along * (a[1][c] - a[0][c]) : a[2][c] + along * (a[3][c] - a[2][c]);
      if (sample == Sample::kEdge) v = far ? a[0][c] : a[1][c];
      if (sample == Sample::kChannels) v = c == 1 ? unit(random) : a[0][c] + along * (a[1][c] - a[0][c]);
      if (sample == Sample::kSmooth)
        v = a[0][c] + 0.04f * (x * a[1][c] + y * a[2][c] + x * y * a[3][c]) + 0.004f * unit(random);
      t.rgba[i][c] = std::clamp(v, 0.0f, 1.0f);
    }
  }
  return t;
}

double squared_error(const BlockTexels& a, const BlockTexels& b, int channels) {
  double sum = 0;
  for (int i = 0; i < 16; ++i)
    for (int c = 0; c < channels; ++c) {
      const double d = 255.0 * (double{a.rgba[i][c]} - b.rgba[i][c]);
      sum += a.weight[i] * d * d;
    }
  return sum;
}

BlockTexels round_trip(const BlockFormat& format, const BlockTexels& texels, const BlockChoice& choice) {
  uint8_t block[16];
  format.encode(texels, choice, block);
  BlockTexels out;
  format.decode(block, out);
  return out;
}

}  // namespace kiln::test

#include "tests/blocks/bc6h_maker.h"

#include <algorithm>
#include <cmath>

namespace kiln::test {

float value_of_half(int bits) {
  const int size = std::abs(bits), exponent = size >> 10, mantissa = size & 1023;
  const double value = exponent ? std::ldexp(1024 + mantissa, exponent - 25) : std::ldexp(mantissa, -24);
  return static_cast<float>(bits < 0 ? -value : value);
}

double step_of(double value) {
  const double size = std::abs(value);
  double step = std::ldexp(size, 24);
  if (step >= 1024) {
    int exponent;
    const double mantissa = std::frexp(size, &exponent);  // in [0.5, 1)
    step = 1024.0 * (exponent + 14) + (2 * mantissa - 1) * 1024;
  }
  return value < 0 ? -step : step;
}

BlockTexels solid(float r, float g, float b) {
  BlockTexels texels;
  for (int i = 0; i < 16; ++i) {
    texels.rgba[i][0] = r;
    texels.rgba[i][1] = g;
    texels.rgba[i][2] = b;
    texels.rgba[i][3] = 1;
    texels.weight[i] = 1;
  }
  return texels;
}

BlockTexels smooth_block(std::mt19937& random, float range, float noise, bool with_signs) {
  std::uniform_real_distribution<float> part(-1, 1);
  BlockTexels texels = solid(0, 0, 0);
  const float sx = part(random), sy = part(random), level = 6 * part(random);
  for (int c = 0; c < 3; ++c) {
    const float cx = sx + 0.2f * part(random), cy = sy + 0.2f * part(random), hue = part(random);
    const float sign = with_signs && part(random) < 0 ? -1.0f : 1.0f;
    for (int i = 0; i < 16; ++i) {
      const float plane = range / 6 * (cx * static_cast<float>(i % 4) + cy * static_cast<float>(i / 4));
      texels.rgba[i][c] = sign * std::exp2(level + hue + plane + noise * part(random));
    }
  }
  return texels;
}

BlockTexels round_trip(const BlockFormat& format, const BlockTexels& texels, const BlockChoice& choice) {
  uint8_t block[16];
  format.encode(texels, choice, block);
  BlockTexels got = texels;
  format.decode(block, got);
  return got;
}

double error_of(const BlockTexels& wanted, const BlockTexels& got, BlockMetric metric) {
  const double y[3] = {0.2126, 0.7152, 0.0722};
  double brightest = 0, sum = 0;
  const auto luminance = [&](const float* t) {
    return y[0] * std::abs(t[0]) + y[1] * std::abs(t[1]) + y[2] * std::abs(t[2]);
  };
  for (int i = 0; i < 16; ++i)
    if (wanted.weight[i] > 0) brightest = std::max(brightest, luminance(wanted.rgba[i]));
  for (int i = 0; i < 16; ++i) {
    if (!(wanted.weight[i] > 0)) continue;
    double d[3], squares = 0;
    for (int c = 0; c < 3; ++c) {
      const double a = wanted.rgba[i][c], b = got.rgba[i][c];
      d[c] = metric == BlockMetric::kLog ? step_of(b) - step_of(a) : b - a;
      squares += d[c] * d[c];
    }
    if (metric == BlockMetric::kPerceptual) {
      const double dy = y[0] * d[0] + y[1] * d[1] + y[2] * d[2];
      const double scale = std::max(luminance(wanted.rgba[i]), 1e-3 * brightest);
      squares =
          (dy * dy + 0.25 * (d[0] - dy) * (d[0] - dy) + 0.25 * (d[2] - dy) * (d[2] - dy)) / scale / scale;
    }
    sum += wanted.weight[i] * squares;
  }
  return sum;
}

}  // namespace kiln::test

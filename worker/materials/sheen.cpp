#include "worker/materials/sheen.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln {
namespace {

constexpr int kCells = 8;  // along both axes

// By roughness k/8 and root of the cosine k/8. Roughness below 0.07 is clamped to 0.07. tests/materials
// integrates the lobe and checks the numbers against it.
constexpr float kAlbedo[kCells + 1][kCells + 1] = {
    {1.0000f, 1.0000f, 0.7399f, 0.1895f, 0.0184f, 0.0004f, 0.0000f, 0.0000f, 0.0000f},
    {1.0000f, 1.0000f, 0.7823f, 0.3595f, 0.1102f, 0.0201f, 0.0015f, 0.0000f, 0.0000f},
    {0.7267f, 0.8327f, 0.6608f, 0.4363f, 0.2442f, 0.1143f, 0.0402f, 0.0082f, 0.0001f},
    {0.5991f, 0.7155f, 0.6101f, 0.4587f, 0.3100f, 0.1893f, 0.0989f, 0.0397f, 0.0057f},
    {0.5677f, 0.6914f, 0.6137f, 0.4945f, 0.3669f, 0.2531f, 0.1576f, 0.0843f, 0.0270f},
    {0.5820f, 0.7104f, 0.6458f, 0.5424f, 0.4256f, 0.3132f, 0.2139f, 0.1328f, 0.0616f},
    {0.6164f, 0.7445f, 0.6857f, 0.5909f, 0.4805f, 0.3674f, 0.2645f, 0.1786f, 0.1009f},
    {0.6466f, 0.7697f, 0.7140f, 0.6246f, 0.5197f, 0.4078f, 0.3034f, 0.2161f, 0.1368f},
    {0.6448f, 0.7632f, 0.7110f, 0.6278f, 0.5300f, 0.4239f, 0.3236f, 0.2398f, 0.1638f},
};

// 4 int albedo(t) t^3 dt of each row, piecewise linear in t = sqrt(cos): a polynomial of degree four on
// each cell, which Boole's rule integrates exactly.
std::array<float, kCells + 1> row_means() {
  std::array<float, kCells + 1> means;
  for (int row = 0; row <= kCells; ++row) {
    double sum = 0;
    for (int c = 0; c < kCells; ++c) {
      const double a = kAlbedo[row][c], b = kAlbedo[row][c + 1], h = 1.0 / kCells;
      const double weight[5] = {7, 32, 12, 32, 7};
      for (int k = 0; k < 5; ++k) {
        const double x = k / 4.0, t = (c + x) * h;
        sum += weight[k] / 90.0 * h * 4 * t * t * t * (a + (b - a) * x);
      }
    }
    means[static_cast<size_t>(row)] = static_cast<float>(sum);
  }
  return means;
}
const std::array<float, kCells + 1> kMeans = row_means();

}  // namespace

SheenAlbedo::SheenAlbedo(float roughness) {
  const float at = std::clamp(roughness, 0.0f, 1.0f) * kCells;
  row_ = std::min(static_cast<int>(at), kCells - 1);
  blend_ = at - static_cast<float>(row_);
  mean_ = kMeans[row_] * (1.0f - blend_) + kMeans[row_ + 1] * blend_;
}

float SheenAlbedo::at(float cos) const {
  const float t = std::sqrt(std::clamp(cos, 0.0f, 1.0f)) * kCells;
  const int c = std::min(static_cast<int>(t), kCells - 1);
  const float x = t - static_cast<float>(c);
  const auto row = [&](int r) { return kAlbedo[r][c] * (1.0f - x) + kAlbedo[r][c + 1] * x; };
  return row(row_) * (1.0f - blend_) + row(row_ + 1) * blend_;
}

}  // namespace kiln

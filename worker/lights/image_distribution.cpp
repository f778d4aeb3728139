#include "worker/lights/image_distribution.h"

#include <bit>

#include "common/base/check.h"
#include "common/math/sequence.h"

namespace kiln {

ImageDistribution::ImageDistribution(uint32_t width, uint32_t height) : width_(width) {
  KILN_CHECK(width > 0 && height > 0 && width < 65536 && height < 65536);
  upper_.reserve(size_t{width} * height + height);
  rows_.reserve(height);
}

void ImageDistribution::add_row(const std::vector<double>& weights, double scale) {
  double sum = 0;
  for (const double w : weights) sum += w;
  row_weights_.push_back(sum * scale);
  rows_.push_back(add_part(weights));
}

void ImageDistribution::finish() {
  for (const double w : row_weights_) total_ += w;
  choice_ = add_part(row_weights_);
}

ImageDistribution::Part ImageDistribution::add_part(const std::vector<double>& weights) {
  const auto size = static_cast<uint32_t>(weights.size());
  const int bits = std::bit_width(std::bit_ceil(size)) - 1;
  const Part part{upper_.size(), guide_.size(), size, 31 - bits};
  double total = 0;
  uint32_t positive = 0;
  size_t largest = 0;
  for (size_t i = 0; i < size; ++i) {
    total += weights[i];
    positive += weights[i] > 0;
    if (weights[i] > weights[largest]) largest = i;
  }
  // One share to each non-zero weight, the rest in proportion, and the rounding remainder to the largest.
  std::vector<uint32_t> counts(size, 0);
  uint32_t left = positive ? kOne : 0;
  for (size_t i = 0; i < size; ++i) {
    if (!(weights[i] > 0)) continue;
    counts[i] = 1 + static_cast<uint32_t>(weights[i] / total * (kOne - positive));
    left -= counts[i];
  }
  counts[largest] += left;
  uint32_t sum = 0;
  for (const uint32_t c : counts) upper_.push_back(sum += c);
  uint32_t at = 0;
  for (uint32_t g = 0; g < 1u << bits; ++g) {
    while (at + 1 < size && upper_[part.first + at] <= g << part.shift) ++at;
    guide_.push_back(static_cast<uint16_t>(at));
  }
  return part;
}

ImageDistribution::Pick ImageDistribution::pick(const Part& part, double scaled, uint32_t i) const {
  const auto x = static_cast<uint32_t>(scaled);
  const uint32_t* upper = upper_.data() + part.first;
  while (upper[i] <= x) ++i;
  const uint32_t low = i ? upper[i - 1] : 0, n = upper[i] - low;
  const auto within = static_cast<float>((scaled - low) / n);
  return {i, n, std::min(within, 0x1.fffffep-1f)};
}

void ImageDistribution::sample(const float* u, const float* v, size_t count, Draw* draws) const {
  KILN_CHECK(count <= kMax);
  Pick rows[kMax];
  double columns[kMax];
  uint32_t starts[kMax];
  for (size_t k = 0; k < count; ++k) {
    const uint64_t more =
        mix_bits(uint64_t{std::bit_cast<uint32_t>(u[k])} << 32 | std::bit_cast<uint32_t>(v[k]));
    const double row = refined(u[k], more) * kOne;
    rows[k] = pick(choice_, row, guide(choice_, row));
    columns[k] = refined(v[k], more >> 32) * kOne;
    __builtin_prefetch(&guide(rows_[rows[k].index], columns[k]));
  }
  for (size_t k = 0; k < count; ++k) {
    const Part& part = rows_[rows[k].index];
    starts[k] = guide(part, columns[k]);
    __builtin_prefetch(&upper_[part.first + starts[k]]);
  }
  for (size_t k = 0; k < count; ++k) {
    const Pick column = pick(rows_[rows[k].index], columns[k], starts[k]);
    draws[k] = {column.index, rows[k].index, Vec2(column.within, rows[k].within),
                static_cast<float>(rows[k].count) * 0x1p-31f * (static_cast<float>(column.count) * 0x1p-31f)};
  }
}

float ImageDistribution::probability(uint32_t x, uint32_t y) const {
  return static_cast<float>(count(choice_, y)) * 0x1p-31f *
         (static_cast<float>(count(rows_[y], x)) * 0x1p-31f);
}

}  // namespace kiln

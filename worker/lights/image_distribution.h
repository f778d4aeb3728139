// Draws a texel of an image in proportion to weights: first a row, then a texel in it.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// Probabilities are multiples of 2^-31 and random numbers have 53 bits, so every texel of positive
// weight is drawn exactly as often as pdf says, however bright its neighbours. A guide table makes
// the search two steps long on average (Chen & Asau 1974).
class ImageDistribution {
 public:
  ImageDistribution() = default;
  // Width and height must be below 65,536; rows are added from the top. Weights are finite and not negative.
  ImageDistribution(uint32_t width, uint32_t height);
  // The row weighs `scale` times the sum of its weights.
  void add_row(const std::vector<double>& weights, double scale);
  void finish();
  bool empty() const { return !(total_ > 0); }  // nothing to choose

  struct Draw {
    uint32_t x, y;
    Vec2 within;        // uniform in [0, 1)^2, left over from u
    float probability;  // of the texel
  };
  // draws[k] for the random numbers (u[k], v[k]); at most kMax at once. Batching overlaps the three
  // memory reads that each draw waits for.
  static constexpr size_t kMax = 64;
  void sample(const float* u, const float* v, size_t count, Draw* draws) const;
  void prefetch(uint32_t x, uint32_t y) const { __builtin_prefetch(&upper_[rows_[y].first + x]); }
  float probability(uint32_t x, uint32_t y) const;

 private:
  static constexpr uint32_t kOne = 1u << 31;
  // One discrete distribution: `size` entries of upper_ starting at `first`.
  struct Part {
    size_t first, guide;
    uint32_t size;
    int shift;  // maps a number below kOne to its slot in the guide
  };
  Part add_part(const std::vector<double>& weights);
  uint32_t count(const Part& part, uint32_t i) const {
    return upper_[part.first + i] - (i ? upper_[part.first + i - 1] : 0);
  }
  struct Pick {
    uint32_t index, count;
    float within;
  };
  // The entry that contains `scaled` (below kOne), searched from entry i upwards.
  Pick pick(const Part& part, double scaled, uint32_t i) const;
  const uint16_t& guide(const Part& part, double scaled) const {
    return guide_[part.guide + (static_cast<uint32_t>(scaled) >> part.shift)];
  }

  uint32_t width_ = 0;
  std::vector<uint32_t> upper_;  // cumulative probability up to and including each entry, times kOne
  std::vector<uint16_t> guide_;  // first entry that a number in this slot can belong to
  std::vector<Part> rows_;
  Part choice_{};  // distribution over rows
  std::vector<double> row_weights_;
  double total_ = 0;
};

}  // namespace kiln

// A discrete distribution sampled by its cumulative sums.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  // Weights are finite and not negative. All zero: total() == 0, and it must not be sampled.
  explicit DiscreteDistribution(const std::vector<double>& weights);
  struct Draw {
    uint32_t index;
    float remainder;  // u reused: uniform in [0, 1) within the chosen interval
  };
  Draw sample(float u) const;
  float probability(uint32_t index) const { return probability_[index]; }
  double total() const { return total_; }
  size_t size() const { return probability_.size(); }

 private:
  std::vector<float> upper_;  // cumulative probability after each entry; the last positive entry is 1
  std::vector<float> probability_;
  double total_ = 0;
};

}  // namespace kiln

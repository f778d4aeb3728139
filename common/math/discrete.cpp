#include "common/math/discrete.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {

DiscreteDistribution::DiscreteDistribution(const std::vector<double>& weights)
    : upper_(weights.size(), 1.0f), probability_(weights.size(), 0.0f) {
  for (double w : weights) total_ += w;
  if (!(total_ > 0)) return;
  double sum = 0;
  float previous = 0;
  size_t last = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    upper_[i] = std::min(1.0f, static_cast<float>(sum / total_));
    if (weights[i] > 0) last = i;
  }
  for (size_t i = last; i < weights.size(); ++i) upper_[i] = 1.0f;
  // The probability is that of the float interval, so that the estimator is exactly unbiased.
  for (size_t i = 0; i < weights.size(); ++i) {
    probability_[i] = upper_[i] - previous;
    previous = upper_[i];
  }
}

DiscreteDistribution::Draw DiscreteDistribution::sample(float u) const {
  KILN_CHECK(total_ > 0);
  const size_t i = std::upper_bound(upper_.begin(), upper_.end(), u) - upper_.begin();
  const float low = i ? upper_[i - 1] : 0.0f;
  const float r = (u - low) / probability_[i];
  return {static_cast<uint32_t>(i), std::clamp(r, 0.0f, 0x1.fffffep-1f)};
}

}  // namespace kiln

// Sums over runs of sites, which in their Morton order are near each other in the world, from prefix sums.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace kiln {

class RunSums {
 public:
  void reserve(size_t sites) { sums_.reserve(sites + 1); }
  void add(double value) { sums_.push_back(sums_.back() + value); }
  /// Sum over the sites from i - reach to i + reach.
  double around(size_t i, size_t reach) const {
    const size_t count = sums_.size() - 1;
    return sums_[std::min(count, i + reach + 1)] - sums_[i > reach ? i - reach : 0];
  }

 private:
  std::vector<double> sums_ = {0.0};
};

}  // namespace kiln

// Sparse linear least squares for corrections, many right sides at once. The only file that knows Eigen is
// solve.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kiln {

// Least over c of
//   sum over rows weight (factor . c + target)^2 + link_weight sum over links (c_a - c_b)^2
//   + sum diagonal_i c_i^2
struct LeastSquares {
  static constexpr uint32_t kFixed = ~0u;  // of unknowns that are none
  struct Row {
    std::array<uint32_t, 8> unknown{};
    std::array<float, 8> factor{};
    uint32_t count = 0;
    double weight = 0;
  };
  struct Link {
    uint32_t a, b;
  };
  std::vector<Row> rows;
  std::vector<Link> links;
  double link_weight = 1;
  std::vector<double> diagonal;  // by unknown; positive
};

struct SolveSettings {
  // Components with more unknowns are solved by conjugate gradients (memory in proportion to the unknowns)
  // instead of a sparse Cholesky factor (which a plane of unknowns fills with n log n numbers).
  uint32_t most_factored = 2'000'000;
  double tolerance = 1e-8;  // of conjugate gradients: residual relative to the right side
  uint32_t most_iterations = 5000;
};

struct Solution {
  std::vector<std::vector<double>> corrections;  // [right side][unknown]
  uint32_t components = 0;                       // independent parts
  uint32_t largest = 0;                          // unknowns of the largest
  double residual = 0;                           // largest |A c - b| / |b| of any part and right side
};

// targets[right side][row]. Parts whose targets are all 0 get exactly 0. With `changed` (by row, not 0: it
// has another weight than when `solution` was found) parts without a changed row keep what `solution` has.
// The same bits for any number of threads.
void solve(const LeastSquares& problem, const std::vector<std::vector<double>>& targets, Solution& solution,
           const std::vector<uint8_t>& changed = {}, const SolveSettings& settings = {});

}  // namespace kiln

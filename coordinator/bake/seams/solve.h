// Sparse linear least squares for corrections, with many right-hand sides. Only solve.cpp includes Eigen.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kiln {

// Minimises over c
//   sum over rows weight (factor . c + target)^2 + sum over links weight (c_a - c_b)^2
//   + sum diagonal_i c_i^2
struct LeastSquares {
  struct Row {
    std::array<uint32_t, 8> unknown{};
    std::array<float, 8> factor{};
    uint32_t count = 0;
    double weight = 0;
  };
  struct Link {
    uint32_t a, b;
    double weight;
  };
  std::vector<Row> rows;
  std::vector<Link> links;
  std::vector<double> diagonal;  // by unknown; positive
};

struct SolveSettings {
  // Components with more unknowns are solved by conjugate gradients (memory in proportion to the unknowns)
  // instead of a sparse Cholesky factor (which a plane of unknowns fills with n log n numbers).
  uint32_t most_factored = 2'000'000;
  double tolerance = 1e-8;  // of conjugate gradients: residual relative to the right-hand side
  uint32_t most_iterations = 5000;
};

// low <= c <= high, by [right side][unknown]; 0 lies between. Empty: unconstrained.
struct SolveLimits {
  std::vector<std::vector<double>> low, high;
  // Rounds of the constrained solve. The result satisfies the limits whatever the count.
  uint32_t rounds = 24;
};

struct Solution {
  std::vector<std::vector<double>> corrections;  // [right side][unknown]
  uint32_t components = 0;                       // independent parts
  uint32_t largest = 0;                          // unknowns of the largest
  double residual = 0;  // of free solves: largest |A c - b| / |b| of any part and right side
};

// targets[right side][row]. Parts whose targets are all 0 get exactly 0. Where the unconstrained solution
// violates the limits, ADMM (Boyd et al. 2011, Distributed Optimization and Statistical Learning via ADMM,
// 5.2) finds the constrained minimum in a fixed number of rounds: one matrix factor serves all right-hand
// sides.
// The same bits for any number of threads.
Solution solve(const LeastSquares& problem, const std::vector<std::vector<double>>& targets,
               const SolveLimits& limits = {}, const SolveSettings& settings = {});

}  // namespace kiln

#include "coordinator/bake/seams/solve.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <numeric>
#include <optional>

#include "common/base/parallel.h"
#include "common/unwrap/charts.h"

namespace kiln {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// A connected part of the problem: its unknowns ascending, its rows and links in order.
struct Part {
  std::vector<uint32_t> unknowns, rows, links;
};

std::vector<Part> parts_of(const LeastSquares& p) {
  UnionFind sets(p.diagonal.size());
  for (const LeastSquares::Row& row : p.rows)
    for (uint32_t k = 1; k < row.count; ++k) sets.merge(row.unknown[0], row.unknown[k]);
  for (const LeastSquares::Link& link : p.links) sets.merge(link.a, link.b);
  std::vector<Part> parts;
  std::vector<uint32_t> number(p.diagonal.size());
  for (uint32_t i = 0; i < number.size(); ++i) {
    const uint32_t root = sets.find(i);  // the smallest, so it has its number
    if (root == i) {
      number[i] = static_cast<uint32_t>(parts.size());
      parts.emplace_back();
    }
    number[i] = number[root];
    parts[number[i]].unknowns.push_back(i);
  }
  for (uint32_t r = 0; r < p.rows.size(); ++r) parts[number[p.rows[r].unknown[0]]].rows.push_back(r);
  for (uint32_t l = 0; l < p.links.size(); ++l) parts[number[p.links[l].a]].links.push_back(l);
  return parts;
}

// Its lower triangle.
Matrix normal_matrix(const LeastSquares& p, const Part& part, const std::vector<uint32_t>& place) {
  using Entry = Eigen::Triplet<double>;
  std::vector<Entry> entries;
  entries.reserve(part.unknowns.size() + 3 * part.links.size() + 36 * part.rows.size());
  const auto add = [&](uint32_t i, uint32_t j, double v) {
    if (place[i] >= place[j]) entries.emplace_back(static_cast<int>(place[i]), static_cast<int>(place[j]), v);
  };
  for (const uint32_t i : part.unknowns) add(i, i, p.diagonal[i]);
  for (const uint32_t l : part.links) {
    const auto [a, b, weight] = p.links[l];
    add(a, a, weight), add(b, b, weight);
    add(a, b, -weight), add(b, a, -weight);
  }
  for (const uint32_t r : part.rows) {
    const LeastSquares::Row& row = p.rows[r];
    for (uint32_t i = 0; row.weight > 0 && i < row.count; ++i)
      for (uint32_t j = 0; j < row.count; ++j)
        add(row.unknown[i], row.unknown[j], row.weight * double{row.factor[i]} * double{row.factor[j]});
  }
  const auto n = static_cast<Eigen::Index>(part.unknowns.size());
  Matrix a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  return a;
}

Eigen::MatrixXd right_sides(const LeastSquares& p, const Part& part, const std::vector<uint32_t>& place,
                            const std::vector<std::vector<double>>& targets) {
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(part.unknowns.size()),
                                            static_cast<Eigen::Index>(targets.size()));
  for (size_t side = 0; side < targets.size(); ++side)
    for (const uint32_t r : part.rows) {
      const LeastSquares::Row& row = p.rows[r];
      for (uint32_t k = 0; k < row.count; ++k)
        b(place[row.unknown[k]], static_cast<Eigen::Index>(side)) -=
            row.weight * double{row.factor[k]} * targets[side][r];
    }
  return b;
}

// Solves repeatedly with one matrix.
class Inverse {
 public:
  Inverse(Matrix a, const SolveSettings& settings) : a_(std::move(a)) {
    if (a_.rows() <= static_cast<Eigen::Index>(settings.most_factored)) {
      // A is the sum of squares and a positive diagonal: the factor exists.
      factor_.compute(a_);
      factored_ = factor_.info() == Eigen::Success;
    }
    if (factored_) return;
    gradients_.setTolerance(settings.tolerance);
    gradients_.setMaxIterations(settings.most_iterations);
    gradients_.compute(a_);
  }
  Eigen::VectorXd operator()(const Eigen::VectorXd& b, const Eigen::VectorXd& guess) const {
    if (factored_) return factor_.solve(b);
    return gradients_.solveWithGuess(b, guess);
  }
  double residual(const Eigen::VectorXd& c, const Eigen::VectorXd& b) const {
    return (a_.selfadjointView<Eigen::Lower>() * c - b).norm() / b.norm();
  }

 private:
  Matrix a_;
  bool factored_ = false;
  Eigen::SimplicialLDLT<Matrix> factor_;
  Eigen::ConjugateGradient<Matrix, Eigen::Lower> gradients_;
};

// A component with its matrices and solutions.
class PartSolver {
 public:
  PartSolver(const LeastSquares& p, const Part& part, const std::vector<uint32_t>& place,
             const std::vector<std::vector<double>>& targets, const SolveLimits& limits,
             const SolveSettings& settings)
      : p_(p), part_(part), limits_(limits), b_(right_sides(p, part, place, targets)) {
    if (b_.isZero(0)) return;
    Matrix a = normal_matrix(p, part, place);
    if (!limits.low.empty()) {
      // Between the weights of the value and seam terms, so that the rounds converge equally fast for both.
      constexpr double kPenalty = 1.0 / 16;
      penalty_ = kPenalty * Eigen::VectorXd(a.diagonal());
      Matrix penalised = a;
      penalised.diagonal() += penalty_;
      within_.emplace(std::move(penalised), settings);
    }
    free_.emplace(std::move(a), settings);
  }
  bool is_zero() const { return !free_; }

  // Solves one right-hand side into its corrections; returns the residual of the unconstrained solution.
  double solve(size_t side, std::vector<double>& out) const {
    const Eigen::VectorXd b = b_.col(static_cast<Eigen::Index>(side));
    if (b.isZero(0)) return 0;
    Eigen::VectorXd c = (*free_)(b, Eigen::VectorXd::Zero(b.size()));
    const double residual = free_->residual(c, b);
    if (within_) c = solve_within(side, b, std::move(c));
    for (Eigen::Index i = 0; i < c.size(); ++i) out[part_.unknowns[static_cast<size_t>(i)]] = c[i];
    return residual;
  }

 private:
  Eigen::VectorXd solve_within(size_t side, const Eigen::VectorXd& b, Eigen::VectorXd c) const {
    Eigen::VectorXd low(c.size()), high(c.size());
    for (Eigen::Index i = 0; i < c.size(); ++i) {
      low[i] = limits_.low[side][part_.unknowns[static_cast<size_t>(i)]];
      high[i] = limits_.high[side][part_.unknowns[static_cast<size_t>(i)]];
    }
    Eigen::VectorXd held = c.cwiseMax(low).cwiseMin(high);
    if (held == c) return c;
    Eigen::VectorXd push = Eigen::VectorXd::Zero(c.size());  // scaled multipliers
    for (uint32_t round = 0; round < limits_.rounds; ++round) {
      c = (*within_)(b + penalty_.cwiseProduct(held - push), c);
      push += c;
      held = push.cwiseMax(low).cwiseMin(high);
      push -= held;
    }
    return held;
  }

  const LeastSquares& p_;
  const Part& part_;
  const SolveLimits& limits_;
  Eigen::MatrixXd b_;
  Eigen::VectorXd penalty_;
  std::optional<Inverse> free_, within_;
};

}  // namespace

Solution solve(const LeastSquares& problem, const std::vector<std::vector<double>>& targets,
               const SolveLimits& limits, const SolveSettings& settings) {
  // Components with more unknowns are solved one by one, with their right-hand sides in parallel.
  constexpr size_t kLarge = 1 << 14;
  const std::vector<Part> parts = parts_of(problem);
  Solution solution;
  solution.corrections.assign(targets.size(), std::vector<double>(problem.diagonal.size(), 0.0));
  std::vector<uint32_t> place(problem.diagonal.size());  // in its part
  for (const Part& part : parts)
    for (uint32_t i = 0; i < part.unknowns.size(); ++i) place[part.unknowns[i]] = i;
  std::vector<double> residual(parts.size(), 0.0);
  const auto solve_part = [&](size_t k, unsigned threads) {
    const PartSolver solver(problem, parts[k], place, targets, limits, settings);
    if (solver.is_zero()) return;
    std::vector<double> residuals(targets.size());
    parallel_for(
        targets.size(), [&](size_t s) { residuals[s] = solver.solve(s, solution.corrections[s]); }, threads);
    residual[k] = *std::max_element(residuals.begin(), residuals.end());
  };
  parallel_for(parts.size(), [&](size_t k) {
    if (parts[k].unknowns.size() <= kLarge) solve_part(k, 1);
  });
  for (size_t k = 0; k < parts.size(); ++k)
    if (parts[k].unknowns.size() > kLarge) solve_part(k, 0);
  solution.components = static_cast<uint32_t>(parts.size());
  for (size_t k = 0; k < parts.size(); ++k) {
    solution.largest = std::max(solution.largest, static_cast<uint32_t>(parts[k].unknowns.size()));
    solution.residual = std::max(solution.residual, residual[k]);
  }
  return solution;
}

}  // namespace kiln

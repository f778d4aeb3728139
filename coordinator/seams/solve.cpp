#include "coordinator/seams/solve.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <numeric>

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

Matrix normal_matrix(const LeastSquares& p, const Part& part, const std::vector<uint32_t>& place) {
  using Entry = Eigen::Triplet<double>;
  std::vector<Entry> entries;
  entries.reserve(part.unknowns.size() + 4 * part.links.size() + 16 * part.rows.size());
  const auto add = [&](uint32_t i, uint32_t j, double v) {
    entries.emplace_back(static_cast<int>(place[i]), static_cast<int>(place[j]), v);
  };
  for (const uint32_t i : part.unknowns) add(i, i, p.diagonal[i]);
  for (const uint32_t l : part.links) {
    const auto [a, b] = p.links[l];
    add(a, a, p.link_weight), add(b, b, p.link_weight);
    add(a, b, -p.link_weight), add(b, a, -p.link_weight);
  }
  for (const uint32_t r : part.rows) {
    const LeastSquares::Row& row = p.rows[r];
    for (uint32_t i = 0; i < row.count; ++i)
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

Eigen::MatrixXd solve_part(const Matrix& a, const Eigen::MatrixXd& b, const SolveSettings& settings) {
  if (b.rows() <= static_cast<Eigen::Index>(settings.most_factored)) {
    // A is the sum of squares and a positive diagonal: the factor exists.
    const Eigen::SimplicialLDLT<Matrix> factor(a);
    if (factor.info() == Eigen::Success) return factor.solve(b);
  }
  Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> gradients(a);
  gradients.setTolerance(settings.tolerance);
  gradients.setMaxIterations(settings.most_iterations);
  return gradients.solve(b);
}

double relative_residual(const Matrix& a, const Eigen::MatrixXd& c, const Eigen::MatrixXd& b) {
  double worst = 0;
  for (Eigen::Index s = 0; s < b.cols(); ++s)
    if (const double size = b.col(s).norm(); size > 0)
      worst = std::max(worst, (a * c.col(s) - b.col(s)).norm() / size);
  return worst;
}

}  // namespace

void solve(const LeastSquares& problem, const std::vector<std::vector<double>>& targets, Solution& solution,
           const std::vector<uint8_t>& changed, const SolveSettings& settings) {
  const std::vector<Part> parts = parts_of(problem);
  if (changed.empty()) {
    solution = {};
    solution.corrections.assign(targets.size(), std::vector<double>(problem.diagonal.size(), 0.0));
  }
  std::vector<uint32_t> place(problem.diagonal.size());  // in its part
  for (const Part& part : parts)
    for (uint32_t i = 0; i < part.unknowns.size(); ++i) place[part.unknowns[i]] = i;
  std::vector<double> residual(parts.size(), 0.0);
  parallel_for(parts.size(), [&](size_t k) {
    const Part& part = parts[k];
    if (!changed.empty() &&
        std::none_of(part.rows.begin(), part.rows.end(), [&](uint32_t r) { return changed[r]; }))
      return;
    const Eigen::MatrixXd b = right_sides(problem, part, place, targets);
    if (b.isZero(0)) return;
    const Matrix a = normal_matrix(problem, part, place);
    const Eigen::MatrixXd c = solve_part(a, b, settings);
    residual[k] = relative_residual(a, c, b);
    for (size_t s = 0; s < targets.size(); ++s)
      for (uint32_t i = 0; i < part.unknowns.size(); ++i)
        solution.corrections[s][part.unknowns[i]] = c(i, static_cast<Eigen::Index>(s));
  });
  solution.components = static_cast<uint32_t>(parts.size());
  for (size_t k = 0; k < parts.size(); ++k) {
    solution.largest = std::max(solution.largest, static_cast<uint32_t>(parts[k].unknowns.size()));
    solution.residual = std::max(solution.residual, residual[k]);
  }
}

}  // namespace kiln

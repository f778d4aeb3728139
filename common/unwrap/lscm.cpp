#include "common/unwrap/lscm.h"

#include <Eigen/Sparse>

namespace kiln {
namespace {

struct Pins {
  uint32_t first = 0, second = 0;
};

// The ends of the longest axis of the bounding box.
Pins far_vertices(std::span<const DVec3> vertices) {
  Pins best;
  double longest = -1;
  for (int axis = 0; axis < 3; ++axis) {
    Pins pins;
    for (uint32_t v = 1; v < vertices.size(); ++v) {
      if (vertices[v][axis] < vertices[pins.first][axis]) pins.first = v;
      if (vertices[v][axis] > vertices[pins.second][axis]) pins.second = v;
    }
    const double extent = vertices[pins.second][axis] - vertices[pins.first][axis];
    if (extent > longest) longest = extent, best = pins;
  }
  return best;
}

class System {
 public:
  System(std::span<const DVec3> vertices, const Pins& pins) : vertices_(vertices), pins_(pins) {
    const auto unknowns = static_cast<Eigen::Index>(2 * vertices.size() - 4);
    right_ = Eigen::VectorXd::Zero(unknowns);
    pinned_length_ = length(vertices[pins.second] - vertices[pins.first]);
  }

  void add_face(const std::array<uint32_t, 3>& f) {
    const std::array<double, 3> w = half_cotangents(vertices_[f[0]], vertices_[f[1]], vertices_[f[2]]);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t p = f[(k + 1) % 3], q = f[(k + 2) % 3];
      for (uint32_t axis = 0; axis < 2; ++axis) {
        add(p, axis, p, axis, w[k]);
        add(q, axis, q, axis, w[k]);
        add(p, axis, q, axis, -w[k]);
        add(q, axis, p, axis, -w[k]);
      }
      // Minus the signed area: (u_p v_q - u_q v_p) / 2 a side; inner sides cancel to an exact zero.
      add(p, 0, q, 1, -0.5);
      add(q, 1, p, 0, -0.5);
      add(q, 0, p, 1, 0.5);
      add(p, 1, q, 0, 0.5);
    }
  }

  std::vector<DVec2> solve() {
    const Eigen::Index n = right_.size();
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(triplets_.begin(), triplets_.end());
    matrix.prune([](Eigen::Index, Eigen::Index, double value) { return value != 0; });
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    if (solver.info() != Eigen::Success) return {};
    const Eigen::VectorXd x = solver.solve(right_);
    std::vector<DVec2> uv(vertices_.size());
    for (uint32_t v = 0; v < uv.size(); ++v) {
      for (uint32_t axis = 0; axis < 2; ++axis)
        uv[v][static_cast<int>(axis)] = pinned(v) ? value(v, axis) : x[unknown(v, axis)];
      if (!(std::abs(uv[v].x) < 1e300 && std::abs(uv[v].y) < 1e300)) return {};
    }
    return uv;
  }

 private:
  bool pinned(uint32_t v) const { return v == pins_.first || v == pins_.second; }
  double value(uint32_t v, uint32_t axis) const {
    return v == pins_.second && axis == 0 ? pinned_length_ : 0.0;
  }
  int unknown(uint32_t v, uint32_t axis) const {
    const uint32_t before = (v > pins_.first ? 1u : 0u) + (v > pins_.second ? 1u : 0u);
    return static_cast<int>(2 * (v - before) + axis);
  }
  void add(uint32_t p, uint32_t p_axis, uint32_t q, uint32_t q_axis, double w) {
    if (pinned(p)) return;
    if (pinned(q))
      right_[unknown(p, p_axis)] -= w * value(q, q_axis);
    else if (unknown(p, p_axis) >= unknown(q, q_axis))  // the solver reads the lower triangle only
      triplets_.emplace_back(unknown(p, p_axis), unknown(q, q_axis), w);
  }

  std::span<const DVec3> vertices_;
  Pins pins_;
  double pinned_length_ = 0;
  std::vector<Eigen::Triplet<double>> triplets_;
  Eigen::VectorXd right_;
};

}  // namespace

std::array<double, 3> half_cotangents(const DVec3& a, const DVec3& b, const DVec3& c) {
  const DVec3 sides[3] = {c - b, a - c, b - a};
  double longest = 0;
  for (const DVec3& s : sides) longest = std::max(longest, dot(s, s));
  const double twice_area = std::max(length(cross(sides[2], -sides[1])), 1e-3 * longest);
  std::array<double, 3> weights{};
  for (int k = 0; k < 3; ++k)
    weights[static_cast<size_t>(k)] = -0.5 * dot(sides[(k + 1) % 3], sides[(k + 2) % 3]) / twice_area;
  return weights;
}

std::vector<DVec2> lscm(std::span<const DVec3> vertices, std::span<const std::array<uint32_t, 3>> faces) {
  if (vertices.size() < 3) return {};
  const Pins pins = far_vertices(vertices);
  if (pins.first == pins.second) return {};
  System system(vertices, pins);
  for (const auto& face : faces) system.add_face(face);
  return system.solve();
}

}  // namespace kiln

#include "common/unwrap/arap.h"

#include <Eigen/Sparse>

#include "common/unwrap/lscm.h"

namespace kiln {
namespace {

using Face = std::array<uint32_t, 3>;

struct Rigid {
  std::array<double, 3> weight;  // half cotangents, by opposite corner
  std::array<DVec2, 3> side;     // from corner k + 1 to k + 2, of the flattened face
};

Rigid lay(const DVec3& a, const DVec3& b, const DVec3& c) {
  const DVec3 ab = b - a, ac = c - a;
  const double along = length(ab);
  DVec2 apex(0.0);
  if (along > 0) {
    apex.x = dot(ac, ab) / along;
    apex.y = std::sqrt(std::max(0.0, dot(ac, ac) - apex.x * apex.x));
  }
  return {half_cotangents(a, b, c), {DVec2(apex.x - along, apex.y), -apex, DVec2(along, 0)}};
}

class Rounds {
 public:
  Rounds(std::span<const DVec3> vertices, std::span<const Face> faces) : faces_(faces) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto n = static_cast<int>(vertices.size()) - 1;  // the last vertex is fixed
    for (const Face& f : faces) {
      rigid_.push_back(lay(vertices[f[0]], vertices[f[1]], vertices[f[2]]));
      for (size_t k = 0; k < 3; ++k) {
        const auto p = static_cast<int>(f[(k + 1) % 3]), q = static_cast<int>(f[(k + 2) % 3]);
        const double w = rigid_.back().weight[k];
        if (p < n) entries.emplace_back(p, p, w);
        if (q < n) entries.emplace_back(q, q, w);
        if (p < n && q < n) entries.emplace_back(std::max(p, q), std::min(p, q), -w);
      }
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(matrix);
  }
  bool ready() const { return solver_.info() == Eigen::Success; }

  void once(std::vector<DVec2>& uv) const {
    const auto n = static_cast<Eigen::Index>(uv.size()) - 1;
    const DVec2 origin = uv.back();
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(n, 2);
    for (size_t i = 0; i < faces_.size(); ++i) {
      const Face& f = faces_[i];
      // The rotation (c, s) that best fits the face to its current position.
      double c = 0, s = 0;
      for (size_t k = 0; k < 3; ++k) {
        const DVec2 now = uv[f[(k + 2) % 3]] - uv[f[(k + 1) % 3]], own = rigid_[i].side[k];
        c += rigid_[i].weight[k] * dot(now, own);
        s += rigid_[i].weight[k] * (own.x * now.y - own.y * now.x);
      }
      const double size = std::sqrt(c * c + s * s);
      if (!(size > 0)) continue;
      c /= size, s /= size;
      for (size_t k = 0; k < 3; ++k) {
        const DVec2 own = rigid_[i].weight[k] * rigid_[i].side[k];
        const DVec2 turned(c * own.x - s * own.y, s * own.x + c * own.y);
        add(f[(k + 2) % 3], turned, right);
        add(f[(k + 1) % 3], -turned, right);
      }
    }
    const Eigen::MatrixX2d solved = solver_.solve(right);
    for (Eigen::Index v = 0; v < n; ++v)
      uv[static_cast<size_t>(v)] = origin + DVec2(solved(v, 0), solved(v, 1));
  }

 private:
  static void add(uint32_t v, const DVec2& value, Eigen::MatrixX2d& right) {
    if (v >= right.rows()) return;
    right(v, 0) += value.x;
    right(v, 1) += value.y;
  }
  std::span<const Face> faces_;
  std::vector<Rigid> rigid_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace

bool make_rigid(std::span<const DVec3> vertices, std::span<const Face> faces, int rounds,
                std::vector<DVec2>& uv) {
  if (vertices.size() < 3 || uv.size() != vertices.size()) return false;
  const Rounds system(vertices, faces);
  if (!system.ready()) return false;
  std::vector<DVec2> moved = uv;
  for (int k = 0; k < rounds; ++k) system.once(moved);
  for (const DVec2& p : moved)
    if (!(std::abs(p.x) < 1e300 && std::abs(p.y) < 1e300)) return false;
  uv = std::move(moved);
  return true;
}

}  // namespace kiln

#include "common/atlas/atlas_lookup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/check.h"

namespace kiln {
namespace {

constexpr size_t kManyParts = 6;  // of a triangle: from here on they are found by a tree
constexpr uint32_t kFew = ~0u;
constexpr uint32_t kMostDepth = 16;

// Whether a point in the closed part may be within `reach` of `centre` along both axes (separating axes).
bool touches(const FacePart& part, const DVec2& centre, double reach) {
  const auto apart = [&](const DVec2& axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const Vec2& c : part.corner) {
      const double along = dot(axis, DVec2(c) - centre);
      least = std::min(least, along);
      most = std::max(most, along);
    }
    const double box = reach * (std::abs(axis.x) + std::abs(axis.y));
    return least > box || most < -box;
  };
  if (apart({1, 0}) || apart({0, 1})) return false;
  for (int i = 0; i < 3; ++i) {
    const DVec2 edge = DVec2(part.corner[(i + 1) % 3]) - DVec2(part.corner[i]);
    if (apart({edge.y, -edge.x})) return false;
  }
  return true;
}

// A point of a triangle by the barycentrics of one of its parts, times the determinant.
struct InPart {
  double det, n1, n2;
  InPart(const FacePart& part, double b1, double b2) {
    const DVec2 a(part.corner[0]), e1 = DVec2(part.corner[1]) - a, e2 = DVec2(part.corner[2]) - a;
    const DVec2 q = DVec2(b1, b2) - a;
    det = e1.x * e2.y - e1.y * e2.x;
    n1 = q.x * e2.y - q.y * e2.x;
    n2 = e1.x * q.y - e1.y * q.x;
  }
  double c1() const { return n1 / det; }
  double c2() const { return n2 / det; }
  // Most parts do not hold the point by the signs alone, without a division.
  bool holds() const {
    if (det > 0 ? n1 < 0 || n2 < 0 : n1 > 0 || n2 > 0 || det == 0) return false;
    return 1 - c1() - c2() >= 0;
  }
  // How deep the point lies in the part, negative outside; in the part's barycentrics times its size, so that
  // slivers do not win by their own small scale. A part without area is the last resort.
  double depth() const {
    if (det == 0) return -std::numeric_limits<double>::infinity();
    return std::min({c1(), c2(), 1 - c1() - c2()}) * std::sqrt(std::abs(det));
  }
};

}  // namespace

// Splits cells of [0, 1]^2 until few parts are left in each, or the leaves would hold too many: long parts
// side by side lie in many cells, and around a point where many meet no cell has few.
class AtlasLookup::TreeBuilder {
 public:
  TreeBuilder(const MeshCharts& charts, Parts& parts) : charts_(charts), parts_(parts) {}

  uint32_t build(std::span<const uint32_t> faces) {
    const auto root = static_cast<uint32_t>(parts_.nodes.size());
    parts_.nodes.emplace_back();
    split(root, faces, {0.5, 0.5}, 0.5, 0, kMostHeld * static_cast<double>(faces.size()));
    return root;
  }

 private:
  static constexpr double kMostHeld = 8;  // by leaves, for each part
  // `most`: how many parts the leaves below may hold together.
  void split(uint32_t node, std::span<const uint32_t> faces, const DVec2& centre, double half, uint32_t depth,
             double most) {
    constexpr size_t kLeaf = 3;
    constexpr double kSlack = 1e-3;  // of a cell, for the rounding of points
    if (faces.size() > kLeaf && depth < kMostDepth) {
      std::vector<uint32_t> in[4];
      size_t all = 0;
      for (uint32_t k = 0; k < 4; ++k) {
        const DVec2 middle = child_centre(centre, half, k);
        for (const uint32_t face : faces)
          if (touches(charts_.parts[face], middle, (1 + kSlack) * half / 2)) in[k].push_back(face);
        all += in[k].size();
      }
      if (static_cast<double>(all) <= most) {
        const auto children = static_cast<uint32_t>(parts_.nodes.size());
        parts_.nodes[node].children = children;
        parts_.nodes.resize(children + 4);
        for (uint32_t k = 0; k < 4; ++k)
          split(children + k, in[k], child_centre(centre, half, k), half / 2, depth + 1,
                most * static_cast<double>(in[k].size()) / static_cast<double>(all));
        return;
      }
    }
    parts_.nodes[node].first = static_cast<uint32_t>(parts_.held.size());
    parts_.held.insert(parts_.held.end(), faces.begin(), faces.end());
    parts_.nodes[node].last = static_cast<uint32_t>(parts_.held.size());
  }
  static DVec2 child_centre(const DVec2& centre, double half, uint32_t k) {
    return centre + half * DVec2(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5);
  }

  const MeshCharts& charts_;
  Parts& parts_;
};

std::span<const uint32_t> AtlasLookup::Parts::near(uint32_t triangle, double b1, double b2) const {
  const std::span<const uint32_t> all(faces.data() + first[triangle], faces.data() + first[triangle + 1]);
  if (root_of.empty() || root_of[triangle] == kFew) return all;
  constexpr double kCells = 1u << kMostDepth;
  const auto cell = [&](double b) {  // 0 for NaN
    return b > 0 ? static_cast<uint32_t>(std::min(b * kCells, kCells - 1)) : 0u;
  };
  const uint32_t x = cell(b1), y = cell(b2);
  const Node* node = &nodes[root_of[triangle]];
  for (uint32_t bit = kMostDepth; node->children && bit-- > 0;)
    node = &nodes[node->children + ((x >> bit & 1) | (y >> bit & 1) << 1)];
  return {held.data() + node->first, held.data() + node->last};
}

AtlasLookup::AtlasLookup(const Atlas& atlas) : atlas_(atlas), parts_(atlas.charts.size()) {
  for (size_t c = 0; c < parts_.size(); ++c) {
    const std::vector<FacePart>& parts = atlas.charts[c].parts;
    if (parts.empty()) continue;
    uint32_t triangles = 0;
    for (const FacePart& part : parts) triangles = std::max(triangles, part.triangle + 1);
    std::vector<uint32_t>&first = parts_[c].first, &faces = parts_[c].faces;
    first.assign(size_t{triangles} + 1, 0);
    for (const FacePart& part : parts) ++first[part.triangle + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    faces.resize(parts.size());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t f = 0; f < parts.size(); ++f) faces[next[parts[f].triangle]++] = f;
    for (uint32_t t = 0; t < triangles; ++t) {
      const std::span<const uint32_t> own(faces.data() + first[t], faces.data() + first[t + 1]);
      if (own.size() < kManyParts) continue;
      parts_[c].root_of.resize(triangles, kFew);
      parts_[c].root_of[t] = TreeBuilder(atlas.charts[c], parts_[c]).build(own);
    }
  }
}

bool AtlasLookup::holds(uint32_t instance, uint32_t triangle) const {
  if (instance >= atlas_.charts_of_instance.size()) return false;
  const Parts& parts = parts_[atlas_.charts_of_instance[instance]];
  if (parts.first.empty()) return triangle < atlas_.of_instance(instance).face_count();
  return triangle + 1 < parts.first.size() && parts.first[triangle] < parts.first[triangle + 1];
}

uint32_t AtlasLookup::face_at(uint32_t instance, uint32_t triangle, double& b1, double& b2) const {
  const Parts& parts = parts_[atlas_.charts_of_instance[instance]];
  if (parts.first.empty()) return triangle;
  const MeshCharts& charts = atlas_.of_instance(instance);
  KILN_CHECK(triangle + 1 < parts.first.size());
  const auto take = [&](uint32_t face, const InPart& at) {
    b1 = at.det == 0 ? 0 : at.c1();
    b2 = at.det == 0 ? 0 : at.c2();
    return face;
  };
  for (const uint32_t face : parts.near(triangle, b1, b2))
    if (const InPart at(charts.parts[face], b1, b2); at.holds()) return take(face, at);
  // In a gap that rounding left between two parts: the one that it is closest to.
  uint32_t best = parts.faces[parts.first[triangle]];
  double most = -std::numeric_limits<double>::infinity();
  for (uint32_t i = parts.first[triangle]; i < parts.first[triangle + 1]; ++i) {
    const double depth = InPart(charts.parts[parts.faces[i]], b1, b2).depth();
    if (depth > most) most = depth, best = parts.faces[i];
  }
  return take(best, InPart(charts.parts[best], b1, b2));
}

AtlasPlace AtlasLookup::at(uint32_t instance, uint32_t triangle, double b1, double b2) const {
  const uint32_t face = face_at(instance, triangle, b1, b2);
  const MeshCharts& charts = atlas_.of_instance(instance);
  AtlasPlace place;
  place.placement = atlas_.instance_first_chart[instance] + charts.chart_of_face[face];
  const ChartPlacement& chart = atlas_.placements[place.placement];
  const Triangle2 uv = uv_triangle(charts, face);
  place.texels = chart.to_texels(uv.c[0] + b1 * (uv.c[1] - uv.c[0]) + b2 * (uv.c[2] - uv.c[0]));
  place.page = chart.page;
  return place;
}

}  // namespace kiln

#include "common/unwrap/surface.h"

#include <algorithm>

#include "common/math/trig.h"
#include "common/unwrap/charts.h"

namespace kiln {

Surface::Surface(const Mesh& m, float crease_degrees) : mesh(m) {
  const size_t count = m.triangles.size();
  normal.assign(count, DVec3(0.0));
  area.assign(count, 0.0);
  for (uint32_t f = 0; f < count; ++f) {
    const DVec3 a = corner(3 * f), b = corner(3 * f + 1), c = corner(3 * f + 2);
    const DVec3 n = cross(b - a, c - a);
    const double twice = length(n);
    const double longest = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
    // Thinner than a millionth of its length: corners are floats, so the normal would be noise.
    if (!(twice > 1e-6 * longest)) continue;
    area[f] = 0.5 * twice;
    normal[f] = n / twice;
  }
  pair_sides(crease_degrees);
}

namespace {

// Reorders both so that entries at one place form pairs: the two faces with the smallest angle between them,
// then the next two; ties go to the smallest numbers. So a floor continues beneath a wall on one of its
// sides, and copies of a sheet stay separate.
void pair_flattest(const std::vector<DVec3>& normal, std::vector<uint32_t>& left,
                   std::vector<uint32_t>& right) {
  constexpr size_t kMax = 4096;  // above this, in order of their numbers
  if (left.size() * right.size() > kMax) return;
  struct Pair {
    double cosine;
    uint32_t left, right;
  };
  std::vector<Pair> pairs;
  for (uint32_t l : left)
    for (uint32_t r : right) pairs.push_back({dot(normal[l / 3], normal[r / 3]), l, r});
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.cosine > b.cosine; });
  std::vector<uint32_t> first, second;
  const auto has = [](const std::vector<uint32_t>& list, uint32_t side) {
    return std::find(list.begin(), list.end(), side) != list.end();
  };
  for (const Pair& p : pairs)
    if (!has(first, p.left) && !has(second, p.right)) first.push_back(p.left), second.push_back(p.right);
  left = std::move(first);
  right = std::move(second);
}

}  // namespace

// A side with two faces has only one pairing.
void Surface::pair_sides(float crease_degrees) {
  const size_t count = face_count();
  opposite.assign(3 * count, kNone);
  attached.assign(count, kNone);
  const std::vector<uint32_t> weld = weld_corners(mesh, {});
  const std::vector<Edge> edges = sorted_edges(weld);
  const double crease = sincos_turns(std::clamp(crease_degrees, 0.0f, 180.0f) / 360.0f).cos;
  const auto shading = [&](uint32_t c) {
    return mesh.normals[mesh.triangles[c / 3][static_cast<int>(c % 3)]];
  };
  const auto sharp = [&](uint32_t p, uint32_t q) {
    return dot(shading(p), shading(next_corner(q))) < crease ||
           dot(shading(next_corner(p)), shading(q)) < crease;
  };
  std::vector<uint32_t> left, right;
  for (size_t i = 0, end; i < edges.size(); i = end) {
    left.clear(), right.clear();
    uint32_t host = kNone;
    for (end = i; end < edges.size() && edges[end].a == edges[i].a && edges[end].b == edges[i].b; ++end) {
      const Edge& e = edges[end];
      if (area[e.triangle] == 0) continue;
      if (host == kNone) host = e.triangle;
      (weld[e.from] == e.a ? left : right).push_back(e.from);
    }
    for (size_t k = i; k < end; ++k)
      if (area[edges[k].triangle] == 0 && attached[edges[k].triangle] == kNone)
        attached[edges[k].triangle] = host;
    if (left.size() + right.size() > 2) pair_flattest(normal, left, right);
    for (size_t k = 0; k < std::min(left.size(), right.size()); ++k)
      if (!sharp(left[k], right[k])) {
        opposite[left[k]] = right[k];
        opposite[right[k]] = left[k];
      }
  }
}

}  // namespace kiln

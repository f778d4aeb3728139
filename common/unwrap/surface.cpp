#include "common/unwrap/surface.h"

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
    // Lower than a millionth of its length: corners are floats, the normal would be noise.
    if (!(twice > 1e-6 * longest)) continue;
    area[f] = 0.5 * twice;
    normal[f] = n / twice;
  }
  pair_sides(crease_degrees);
}

// Around a side with two faces the pairing is plain. Where more meet, those that run one way are paired with
// those that run the other in the order of their numbers, so that copies of a sheet stay apart.
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
    for (size_t k = 0; k < std::min(left.size(), right.size()); ++k)
      if (!sharp(left[k], right[k])) {
        opposite[left[k]] = right[k];
        opposite[right[k]] = left[k];
      }
  }
}

}  // namespace kiln

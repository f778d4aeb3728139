// Region growing over faces, then orthogonal projection: the classic box-map idea with free axes. A region
// keeps a face only if its projection meets no other face of the region, decided exactly with a grid of
// faces, so spirals and stacked sheets fall into several charts.
#include "common/unwrap/unwrap_simple.h"

#include "common/unwrap/charts.h"
#include "common/unwrap/face_grid.h"

namespace kiln {
namespace {

constexpr uint32_t kNone = ~0u;
// Beyond this angle from the axis a projected face is stretched fourfold.
constexpr float kSteepestDegrees = 75.0f;

struct Faces {
  std::vector<DVec3> normal;  // unit; zero: no area
  std::vector<double> area;
  std::vector<uint32_t> first_neighbour, neighbour;
  explicit Faces(const Mesh& mesh);
};

Faces::Faces(const Mesh& mesh) {
  const size_t count = mesh.triangles.size();
  for (const UVec3& v : mesh.triangles) {
    const DVec3 a(mesh.positions[v.x]);
    const DVec3 n = cross(DVec3(mesh.positions[v.y]) - a, DVec3(mesh.positions[v.z]) - a);
    const double twice = length(n);
    area.push_back(0.5 * twice);
    normal.push_back(twice > 0 ? n / twice : DVec3(0.0));
  }
  const std::vector<Edge> edges = sorted_edges(weld_corners(mesh, {}));
  const auto each_pair = [&](const auto& visit) {  // successive faces at one side, so fans stay linear
    for (size_t i = 1; i < edges.size(); ++i)
      if (edges[i].a == edges[i - 1].a && edges[i].b == edges[i - 1].b)
        visit(edges[i - 1].triangle, edges[i].triangle);
  };
  first_neighbour.resize(count + 1);
  each_pair([&](uint32_t p, uint32_t q) { ++first_neighbour[p + 1], ++first_neighbour[q + 1]; });
  std::partial_sum(first_neighbour.begin(), first_neighbour.end(), first_neighbour.begin());
  neighbour.resize(first_neighbour[count]);
  std::vector<uint32_t> next(first_neighbour.begin(), first_neighbour.end() - 1);
  each_pair([&](uint32_t p, uint32_t q) { neighbour[next[p]++] = q, neighbour[next[q]++] = p; });
}

class Unwrapper {
 public:
  Unwrapper(const Mesh& mesh, float crease_degrees)
      : mesh_(mesh), faces_(mesh), visited_(mesh.triangles.size(), kNone) {
    const double degree = double{kPi} / 180;
    crease_ = std::cos(std::clamp(crease_degrees, 1.0f, kSteepestDegrees) * degree);
    steepest_ = std::cos(kSteepestDegrees * degree);
    charts_.generated = true;
    charts_.corner_uv.resize(3 * mesh.triangles.size());
    charts_.chart_of_face.assign(mesh.triangles.size(), kNone);
  }

  MeshCharts run() {
    std::vector<uint32_t> seeds(mesh_.triangles.size());
    std::iota(seeds.begin(), seeds.end(), 0u);
    std::sort(seeds.begin(), seeds.end(), [&](uint32_t a, uint32_t b) {
      return faces_.area[a] != faces_.area[b] ? faces_.area[a] > faces_.area[b] : a < b;
    });
    for (uint32_t seed : seeds)
      if (charts_.chart_of_face[seed] == kNone) make_chart(seed);
    return std::move(charts_);
  }

 private:
  // Free faces reachable from `seed` over faces that `accept` takes, nearest first; accept is asked once a
  // face.
  template <class Accept>
  std::vector<uint32_t> grow(uint32_t seed, const Accept& accept) {
    const uint32_t mark = mark_++;
    std::vector<uint32_t> region{seed};
    visited_[seed] = mark;
    for (size_t i = 0; i < region.size(); ++i) {
      const uint32_t face = region[i];
      for (uint32_t n = faces_.first_neighbour[face]; n < faces_.first_neighbour[face + 1]; ++n) {
        const uint32_t other = faces_.neighbour[n];
        if (visited_[other] == mark || charts_.chart_of_face[other] != kNone) continue;
        visited_[other] = mark;
        if (accept(other)) region.push_back(other);
      }
    }
    return region;
  }

  void make_chart(uint32_t seed) {
    const DVec3 direction = faces_.normal[seed];
    const auto within_crease = [&](uint32_t f) {
      return faces_.area[f] == 0 || dot(faces_.normal[f], direction) >= crease_;
    };
    std::vector<uint32_t> region = grow(seed, within_crease);
    const std::vector<Triangle2> flat = project(region, axis_of(region, direction));
    if (region.size() > 1) {
      std::vector<uint32_t>& slot = slot_;
      slot.resize(visited_.size());
      for (uint32_t k = 0; k < region.size(); ++k) slot[region[k]] = k;
      FaceGrid grid(flat);
      grid.add(0);
      region = grow(seed, [&](uint32_t f) { return within_crease(f) && grid.add_if_free(slot[f]); });
      for (uint32_t f : region) store(f, flat[slot[f]]);
    } else {
      store(seed, flat[0]);
    }
    ++charts_.chart_count;
  }

  // The mean normal, unless some face is too steep for it; every face is near enough to the seed's.
  DVec3 axis_of(const std::vector<uint32_t>& region, const DVec3& fallback) const {
    DVec3 sum(0.0);
    for (uint32_t f : region) sum += faces_.area[f] * faces_.normal[f];
    if (!(length(sum) > 0)) return fallback;
    const DVec3 axis = sum / length(sum);
    for (uint32_t f : region)
      if (faces_.area[f] > 0 && dot(axis, faces_.normal[f]) < steepest_) return fallback;
    return axis;
  }

  // Along `axis`, with a side of the first (largest) face along u, that which makes the smallest box; moved
  // to begin at 0.
  std::vector<Triangle2> project(const std::vector<uint32_t>& region, DVec3 axis) const {
    if (!(length(axis) > 0)) axis = DVec3(0, 0, 1);
    std::vector<Triangle2> best;
    double least = std::numeric_limits<double>::infinity();
    const UVec3& first = mesh_.triangles[region[0]];
    for (int k = 0; k < 3; ++k) {
      DVec3 side = DVec3(mesh_.positions[first[(k + 1) % 3]]) - DVec3(mesh_.positions[first[k]]);
      side -= dot(side, axis) * axis;
      if (!(length(side) > 0)) side = cross(axis, std::abs(axis.x) < 0.5 ? DVec3(1, 0, 0) : DVec3(0, 1, 0));
      double box;
      std::vector<Triangle2> flat = project_on(region, axis, side / length(side), box);
      if (best.empty() || box < least * 0.999) {  // a tie stays with the first
        best = std::move(flat);
        least = box;
      }
    }
    return best;
  }

  std::vector<Triangle2> project_on(const std::vector<uint32_t>& region, const DVec3& axis, const DVec3& u,
                                    double& box) const {
    const DVec3 v = cross(axis, u);
    std::vector<Triangle2> flat;
    flat.reserve(region.size());
    DVec2 lo(std::numeric_limits<double>::infinity()), hi = -lo;
    for (uint32_t f : region) {
      Triangle2& t = flat.emplace_back();
      for (int k = 0; k < 3; ++k) {
        const DVec3 p(mesh_.positions[mesh_.triangles[f][k]]);
        t.c[k] = DVec2(dot(p, u), dot(p, v));
        lo = glm::min(lo, t.c[k]);
        hi = glm::max(hi, t.c[k]);
      }
    }
    box = (hi.x - lo.x) * (hi.y - lo.y);
    for (Triangle2& t : flat)
      for (DVec2& c : t.c) c = DVec2(Vec2(c - lo));  // as it will be stored
    return flat;
  }

  void store(uint32_t face, const Triangle2& flat) {
    charts_.chart_of_face[face] = charts_.chart_count;
    for (size_t k = 0; k < 3; ++k) charts_.corner_uv[3 * size_t{face} + k] = Vec2(flat.c[k]);
  }

  const Mesh& mesh_;
  Faces faces_;
  double crease_, steepest_;
  MeshCharts charts_;
  std::vector<uint32_t> visited_, slot_;
  uint32_t mark_ = 0;
};

}  // namespace

MeshCharts unwrap_simple(const Mesh& mesh, float crease_degrees) {
  return Unwrapper(mesh, crease_degrees).run();
}

}  // namespace kiln

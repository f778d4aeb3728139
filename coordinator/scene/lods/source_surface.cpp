#include "coordinator/scene/lods/source_surface.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {
namespace {

DVec3 unit_or(const DVec3& v, const DVec3& otherwise) {
  const double size = length(v);
  return size > 0 ? v / size : otherwise;
}

// Twice the area.
double area2_of(const DVec2& a, const DVec2& b, const DVec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace

DVec2 nearest_on_triangle(const DVec3& p, const DVec3& a, const DVec3& b, const DVec3& c) {
  const DVec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  const DVec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 != d3) return {d1 / (d1 - d3), 0};
  const DVec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 != d6) return {0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4, along = d4 - d3, back = d5 - d6;
  if (va <= 0 && along >= 0 && back >= 0 && along + back > 0) {
    const double w = along / (along + back);
    return {1 - w, w};
  }
  const double sum = va + vb + vc;
  return sum > 0 ? DVec2(vb / sum, vc / sum) : DVec2(0, 0);
}

SourceSurface::SourceSurface(const Scene& scene, const Atlas& atlas, const std::vector<uint32_t>& instances) {
  for (const uint32_t i : instances) add_instance(scene, atlas, i);
  tree_.emplace(triangles_);
}

void SourceSurface::add_instance(const Scene& scene, const Atlas& atlas, uint32_t instance) {
  const Instance& in = scene.instances[instance];
  const Mesh& mesh = scene.meshes[in.mesh];
  const MeshCharts& charts = atlas.of_instance(instance);
  const double side = determinant(in.to_world) < 0 ? -1 : 1;
  const uint32_t first = atlas.instance_first_chart[instance];
  std::vector<Density> density(charts.chart_count);
  for (uint32_t c = 0; c < charts.chart_count; ++c) density[c].placement = first + c;
  for (size_t f = 0; f < charts.face_count(); ++f) {
    Face face;
    face.placement = first + charts.chart_of_face[f];
    Vec3 corner[3];
    face_corners(mesh, charts, f, corner);
    const Triangle2 texels = texel_triangle(charts, atlas.placements[face.placement], f);
    const UVec3& v = mesh.triangles[charts.triangle_of(f)];
    WorldTriangle world{instance, static_cast<uint32_t>(f), {}};
    for (int k = 0; k < 3; ++k) {
      world.corner[k] = transform_point(in.to_world, corner[k]);
      face.corner[k] = DVec3(world.corner[k]);
      bounds_.add(face.corner[k]);
      face.texels[k] = texels.c[static_cast<size_t>(k)];
    }
    const DVec3 area = side * cross(face.corner[1] - face.corner[0], face.corner[2] - face.corner[0]);
    face.facing = unit_or(area, DVec3(0, 0, 0));
    for (int k = 0; k < 3; ++k) {
      const Vec2 b = charts.parts.empty() ? Vec2(k == 1, k == 2) : charts.parts[f].corner[k];
      const Vec3 n = mesh.normals[v.x] * (1 - b.x - b.y) + mesh.normals[v.y] * b.x + mesh.normals[v.z] * b.y;
      face.normal[k] = unit_or(DVec3(transform_normal(in.to_world, n)), face.facing);
    }
    Density& sum = density[charts.chart_of_face[f]];
    sum.square_metres += 0.5 * length(area);
    sum.square_texels += 0.5 * std::abs(area2_of(texels.c[0], texels.c[1], texels.c[2]));
    faces_.push_back(face);
    triangles_.push_back(world);
  }
  density_.insert(density_.end(), density.begin(), density.end());
}

template <class Accept>
std::optional<LitPoint> SourceSurface::search(const DisplayPoint& point, double reach, double normal_weight,
                                              uint32_t placement, const Accept& accept) const {
  double most = reach * reach;  // squared distance of boxes to visit: a cost is never below it
  std::optional<LitPoint> best;
  uint32_t best_face = 0;
  tree_->for_each_near(point.at, most, [&](uint32_t index) {
    const Face& f = faces_[index];
    if (placement != kAnyPlacement && f.placement != placement) return;
    const DVec2 b = nearest_on_triangle(point.at, f.corner[0], f.corner[1], f.corner[2]);
    const double w[3] = {1 - b.x - b.y, b.x, b.y};
    LitPoint p;
    p.at = w[0] * f.corner[0] + w[1] * f.corner[1] + w[2] * f.corner[2];
    const DVec3 away = p.at - point.at;
    const double square = dot(away, away);
    if (square > reach * reach) return;
    p.normal = unit_or(w[0] * f.normal[0] + w[1] * f.normal[1] + w[2] * f.normal[2], f.facing);
    const DVec3 turn = p.normal - point.normal;
    p.cost = square + normal_weight * dot(turn, turn);
    if (best && (p.cost > best->cost || (p.cost == best->cost && index > best_face))) return;
    if (!accept(p.normal, f.facing)) return;
    p.texels = w[0] * f.texels[0] + w[1] * f.texels[1] + w[2] * f.texels[2];
    p.placement = f.placement;
    p.distance = std::sqrt(square);
    best = p;
    best_face = index;
    most = std::min(most, p.cost);
  });
  return best;
}

std::optional<LitPoint> SourceSurface::nearest(const DisplayPoint& point, const SurfaceSearch& how,
                                               uint32_t placement) const {
  return search(point, how.reach, SurfaceSearch::kTurn * how.reach * how.reach, placement,
                [&](const DVec3& normal, const DVec3& facing) {
                  return dot(normal, point.normal) >= SurfaceSearch::kMinCosine &&
                         dot(facing, point.facing) > 0;
                });
}

LitPoint SourceSurface::nearest_of_any_normal(const DisplayPoint& point, uint32_t placement) const {
  const auto found = search(point, 1e150, 0, placement, [](const DVec3&, const DVec3&) { return true; });
  KILN_CHECK(found.has_value());
  return *found;
}

double SourceSurface::texels_per_metre(uint32_t placement) const {
  const auto at = std::lower_bound(density_.begin(), density_.end(), placement,
                                   [](const Density& d, uint32_t p) { return d.placement < p; });
  KILN_CHECK(at != density_.end() && at->placement == placement);
  return at->square_metres > 0 ? std::sqrt(at->square_texels / at->square_metres) : 0;
}

double SourceSurface::size() const {
  return length(bounds_.high - bounds_.low);
}

}  // namespace kiln

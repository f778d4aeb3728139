#include "common/unwrap/flatten.h"

#include <array>
#include <numeric>

#include "common/unwrap/arap.h"
#include "common/unwrap/charts.h"
#include "common/unwrap/face_grid.h"
#include "common/unwrap/lscm.h"

namespace kiln {
namespace {

constexpr double kFlat = 0.995;    // cosine: faces within 5.7 degrees of a plane are projected, 0.5 % stretch
constexpr double kSteepest = 0.2;  // cosine: faces beyond 78 degrees are not projected
constexpr double kUpright = 0.02;  // below this, ARAP is not worth its cost
constexpr double kEasyL2 = 1.02, kEasyLinf = 1.5;  // a projection this good is used without a solve
constexpr size_t kMaxSolved = 12000;               // most faces of one solve
constexpr size_t kMaxRigid = 200000;               // ARAP's matrix is a quarter of that
constexpr double kMaxToMend = 1.4;                 // L2 above which ARAP is not attempted
constexpr int kRigidRounds = 6;
constexpr uint64_t kRigidWork = 16;
constexpr uint64_t kSolveWork = 16;    // cost of a solved face, in projected faces
constexpr size_t kMaxHullSides = 256;  // directions tested for the smallest box

struct Patch {
  std::vector<DVec3> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
};

// Builds vertices by walking over glued sides: where sheets touch at a point, or a cut ends inside the chart,
// the vertex is split, so a patch is always manifold.
Patch make_patch(const Surface& surface, ChartState& state, const std::vector<uint32_t>& faces) {
  for (uint32_t i = 0; i < faces.size(); ++i) state.slot[faces[i]] = i;
  UnionFind same(3 * faces.size());
  const auto local = [&](uint32_t corner) { return 3 * state.slot[corner / 3] + corner % 3; };
  for (uint32_t f : faces)
    for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
      if (!state.glued[side]) continue;
      const uint32_t other = surface.opposite[side];
      same.merge(local(side), local(next_corner(other)));
      same.merge(local(next_corner(side)), local(other));
    }
  Patch patch;
  std::vector<uint32_t> number(3 * faces.size());
  patch.faces.resize(faces.size());
  for (uint32_t c = 0; c < number.size(); ++c) {
    const uint32_t root = same.find(c);
    if (root == c) {
      number[c] = static_cast<uint32_t>(patch.vertices.size());
      patch.vertices.push_back(surface.corner(3 * faces[c / 3] + c % 3));
    }
    patch.faces[c / 3][c % 3] = number[root];
  }
  return patch;
}

std::vector<Triangle2> faces_at(const Patch& patch, const std::vector<DVec2>& uv) {
  std::vector<Triangle2> flat(patch.faces.size());
  for (size_t i = 0; i < flat.size(); ++i)
    for (size_t k = 0; k < 3; ++k) flat[i].c[k] = uv[patch.faces[i][k]];
  return flat;
}

std::vector<DVec2> vertices_at(const Patch& patch, const std::vector<Triangle2>& flat) {
  std::vector<DVec2> uv(patch.vertices.size());
  for (size_t i = 0; i < flat.size(); ++i)
    for (size_t k = 0; k < 3; ++k) uv[patch.faces[i][k]] = flat[i].c[k];
  return uv;
}

std::vector<Triangle2> project(const Surface& surface, const std::vector<uint32_t>& faces,
                               const DVec3& axis) {
  DVec3 u = cross(axis, std::abs(axis.x) < 0.5 ? DVec3(1, 0, 0) : DVec3(0, 1, 0));
  u = u / length(u);
  const DVec3 v = cross(axis, u);
  std::vector<Triangle2> flat(faces.size());
  for (size_t i = 0; i < faces.size(); ++i)
    for (uint32_t k = 0; k < 3; ++k) {
      const DVec3 p = surface.corner(3 * faces[i] + k);
      flat[i].c[k] = DVec2(dot(p, u), dot(p, v));
    }
  return flat;
}

// Convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<DVec2> hull_of(const std::vector<Triangle2>& flat) {
  std::vector<DVec2> points;
  points.reserve(3 * flat.size());
  for (const Triangle2& t : flat) points.insert(points.end(), t.c, t.c + 3);
  std::sort(points.begin(), points.end(),
            [](const DVec2& a, const DVec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  std::vector<DVec2> hull;
  const auto sweep = [&](auto begin, auto end) {
    const size_t base = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() >= base + 2 && area2(hull[hull.size() - 2], hull.back(), *p) <= 0) hull.pop_back();
      hull.push_back(*p);
    }
    hull.pop_back();
  };
  sweep(points.begin(), points.end());
  sweep(points.rbegin(), points.rend());
  return hull;
}

DVec2 best_direction(const std::vector<Triangle2>& flat) {
  const std::vector<DVec2> hull = hull_of(flat);
  DVec2 best(1, 0);
  double least = std::numeric_limits<double>::infinity();
  const size_t step = hull.size() / kMaxHullSides + 1;
  for (size_t i = 0; i < hull.size(); i += step) {
    const DVec2 side = hull[(i + 1) % hull.size()] - hull[i];
    const double size = std::sqrt(dot(side, side));
    if (!(size > 0)) continue;
    const DVec2 u = side / size;
    DVec2 lo(std::numeric_limits<double>::infinity()), hi = -lo;
    for (const DVec2& p : hull) {
      const DVec2 q(dot(p, u), u.x * p.y - u.y * p.x);
      lo = glm::min(lo, q);
      hi = glm::max(hi, q);
    }
    const double box = (hi.x - lo.x) * (hi.y - lo.y);
    if (box < 0.999 * least) {  // the first wins a tie
      least = box;
      best = u;
    }
  }
  return best;
}

bool usable(const std::vector<Triangle2>& flat, const Stretch& stretch, const FlattenLimits& limits) {
  if (!(stretch.l2 <= limits.l2 && stretch.linf <= limits.linf)) return false;
  FaceGrid grid(flat);
  for (uint32_t i = 0; i < flat.size(); ++i)
    if (!(area2(flat[i]) > 0) || !grid.add_if_free(i)) return false;
  return true;
}

}  // namespace

Stretch measure_stretch(const Surface& surface, const std::vector<uint32_t>& faces,
                        const std::vector<Triangle2>& flat) {
  double sum = 0, area = 0, most = 0;
  for (size_t i = 0; i < faces.size(); ++i) {
    const Triangle2& t = flat[i];
    const double twice = area2(t);
    const DVec3 q1 = surface.corner(3 * faces[i]), q2 = surface.corner(3 * faces[i] + 1),
                q3 = surface.corner(3 * faces[i] + 2);
    const DVec3 ds =
        (q1 * (t.c[1].y - t.c[2].y) + q2 * (t.c[2].y - t.c[0].y) + q3 * (t.c[0].y - t.c[1].y)) / twice;
    const DVec3 dt =
        (q1 * (t.c[2].x - t.c[1].x) + q2 * (t.c[0].x - t.c[2].x) + q3 * (t.c[1].x - t.c[0].x)) / twice;
    const double a = dot(ds, ds), b = dot(ds, dt), c = dot(dt, dt);
    const double larger = 0.5 * (a + c + std::sqrt((a - c) * (a - c) + 4 * b * b));
    sum += 0.5 * (a + c) * surface.area[faces[i]];
    area += surface.area[faces[i]];
    if (!(larger <= most)) most = larger;  // NaN passes through
  }
  return {std::sqrt(sum / area), std::sqrt(most)};
}

void settle(std::vector<Triangle2>& flat, double area) {
  double covered = 0;
  for (const Triangle2& t : flat) covered += 0.5 * std::abs(area2(t));
  const double scale = covered > 0 ? std::sqrt(area / covered) : 1.0;
  const DVec2 u = best_direction(flat) * scale;
  DVec2 lo(std::numeric_limits<double>::infinity());
  for (Triangle2& t : flat)
    for (DVec2& c : t.c) {
      c = DVec2(dot(c, u), u.x * c.y - u.y * c.x);
      lo = glm::min(lo, c);
    }
  for (Triangle2& t : flat)
    for (DVec2& c : t.c) c = DVec2(Vec2(c - lo));  // rounded as it will be stored
}

FlatChart flatten_single(const Surface& surface, uint32_t face) {
  const DVec3 a = surface.corner(3 * face);
  const DVec3 b = surface.corner(3 * face + 1) - a, c = surface.corner(3 * face + 2) - a;
  // The longest side along u from (0, 0): rounding cannot flip the face.
  const double ab = length(b), ac = length(c), bc = length(c - b);
  const uint32_t first = ab >= bc && ab >= ac ? 0 : bc >= ac ? 1 : 2;
  const double base = std::max({ab, bc, ac});
  const DVec3 from = surface.corner(3 * face + first);
  const DVec3 along = base > 0 ? (surface.corner(3 * face + (first + 1) % 3) - from) / base : DVec3(1, 0, 0);
  const DVec3 apex = surface.corner(3 * face + (first + 2) % 3) - from;
  const double x = std::clamp(dot(apex, along), 0.0, base);
  FlatChart chart;
  chart.faces = {face};
  chart.area = surface.area[face];
  chart.flat.resize(1);
  chart.flat[0].c[first] = DVec2(0.0);
  chart.flat[0].c[(first + 1) % 3] = DVec2(Vec2(DVec2(base, 0)));
  chart.flat[0].c[(first + 2) % 3] = DVec2(Vec2(DVec2(x, length(apex - x * along))));
  return chart;
}

std::optional<FlatChart> flatten(const Surface& surface, ChartState& state, std::vector<uint32_t> faces,
                                 const FlattenLimits& limits, uint64_t& work) {
  if (faces.size() == 1) return flatten_single(surface, faces[0]);
  FlatChart chart;
  chart.faces = std::move(faces);
  DVec3 axis(0.0);
  for (uint32_t f : chart.faces) {
    axis += surface.area[f] * surface.normal[f];
    chart.area += surface.area[f];
  }
  double steepest = -1;
  if (const double size = length(axis); size > 0) {
    axis = axis / size;
    steepest = 1;
    for (uint32_t f : chart.faces) steepest = std::min(steepest, dot(axis, surface.normal[f]));
  }
  const auto accept = [&](std::vector<Triangle2> flat, const FlattenLimits& most) {
    work += flat.size();
    settle(flat, chart.area);
    chart.stretch = measure_stretch(surface, chart.faces, flat);
    chart.flat = std::move(flat);
    return usable(chart.flat, chart.stretch, most);
  };
  // Project where that is good enough: no solve, and no limit on the number of faces.
  const auto accept_projected = [&](const FlattenLimits& most) {
    return steepest > kSteepest && accept(project(surface, chart.faces, axis), most);
  };
  if (steepest >= kFlat) return accept_projected(limits) ? std::optional(std::move(chart)) : std::nullopt;
  if (accept_projected({std::min(limits.l2, kEasyL2), std::min(limits.linf, kEasyLinf)})) return chart;
  if (chart.faces.size() > kMaxRigid)
    return accept_projected(limits) ? std::optional(std::move(chart)) : std::nullopt;
  const Patch patch = make_patch(surface, state, chart.faces);
  std::vector<DVec2> uv;
  if (chart.faces.size() <= kMaxSolved) {
    work += kSolveWork * chart.faces.size();
    uv = lscm(patch.vertices, patch.faces);
    if (!uv.empty() && accept(faces_at(patch, uv), limits)) return chart;
    if (!(chart.stretch.l2 < kMaxToMend)) uv.clear();
  }
  if (accept_projected(limits)) return chart;
  if (uv.empty()) {
    if (!(steepest > kUpright)) return std::nullopt;
    uv = vertices_at(patch, project(surface, chart.faces, axis));
  }
  work += kRigidWork * chart.faces.size();
  if (make_rigid(patch.vertices, patch.faces, kRigidRounds, uv) && accept(faces_at(patch, uv), limits))
    return chart;
  return std::nullopt;
}

}  // namespace kiln

#include "tests/seams/plain_seams.h"

namespace kiln::test {
namespace {

struct Side {
  DVec3 p[2], third, normal[2];
  DVec2 texel[2];
  uint32_t page, instance;
};

std::vector<Side> all_sides(const Scene& scene, const Atlas& atlas) {
  std::vector<Side> sides;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    const Instance& object = scene.instances[i];
    const Mesh& mesh = scene.meshes[object.mesh];
    for (size_t face = 0; face < charts.face_count(); ++face)
      for (int k = 0; k < 3; ++k) {
        Vec3 corner[3];
        face_corners(mesh, charts, face, corner);
        const ChartPlacement& place =
            atlas.placements[atlas.instance_first_chart[i] + charts.chart_of_face[face]];
        const Triangle2 t = texel_triangle(charts, place, face);
        const UVec3& v = mesh.triangles[charts.triangle_of(face)];
        Side s{};
        for (int e = 0; e < 2; ++e) {
          const int c = (k + e) % 3;
          s.p[e] = DVec3(transform_point(object.to_world, corner[c]));
          s.normal[e] = normalize(DVec3(transform_normal(object.to_world, mesh.normals[v[c]])));
          s.texel[e] = t.c[c];
        }
        s.third = DVec3(transform_point(object.to_world, corner[(k + 2) % 3]));
        s.page = place.page;
        s.instance = i;
        sides.push_back(s);
      }
  }
  return sides;
}

double place_on(const Side& s, const DVec3& q) {
  return dot(q - s.p[0], s.p[1] - s.p[0]) / dot(s.p[1] - s.p[0], s.p[1] - s.p[0]);
}

// Place t of side a, if b has it too.
bool seam_at(const Side& a, const Side& b, double t, double degrees, double tolerance, PlainPoint& out) {
  const DVec3 q = a.p[0] + (a.p[1] - a.p[0]) * t;
  const double u = place_on(b, q);
  if (u < 0 || u > 1 || length(b.p[0] + (b.p[1] - b.p[0]) * u - q) > tolerance) return false;
  const DVec3 na = normalize(a.normal[0] * (1 - t) + a.normal[1] * t);
  const DVec3 nb = normalize(b.normal[0] * (1 - u) + b.normal[1] * u);
  if (dot(na, nb) < std::cos(degrees * M_PI / 180)) return false;
  const DVec3 into_a = a.third - (a.p[0] + (a.p[1] - a.p[0]) * place_on(a, a.third));
  const DVec3 into_b = b.third - (b.p[0] + (b.p[1] - b.p[0]) * place_on(b, b.third));
  if (dot(into_a, into_b) > 0) return false;
  out = {q,
         {a.texel[0] + (a.texel[1] - a.texel[0]) * t, b.texel[0] + (b.texel[1] - b.texel[0]) * u},
         {a.page, b.page},
         {a.instance, b.instance}};
  return a.page != b.page || length(out.texel[0] - out.texel[1]) > 0.01;
}

}  // namespace

std::vector<PlainPoint> plain_seam_points(const Scene& scene, const Atlas& atlas, size_t count,
                                          double degrees, double tolerance) {
  const std::vector<Side> sides = all_sides(scene, atlas);
  std::vector<PlainPoint> all;
  for (size_t i = 0; i < sides.size(); ++i)
    for (size_t j = i + 1; j < sides.size(); ++j) {
      const DVec3 along = sides[i].p[1] - sides[i].p[0], other = sides[j].p[1] - sides[j].p[0];
      if (length(cross(along, other)) > 1e-3 * length(along) * length(other)) continue;
      const double n = std::ceil(length(along) * 200);  // every 5 mm
      PlainPoint p;
      for (double k = 0; k < n; ++k)
        if (seam_at(sides[i], sides[j], (k + 0.5) / n, degrees, tolerance, p)) all.push_back(p);
    }
  std::vector<PlainPoint> chosen;
  if (all.empty()) return chosen;
  for (size_t k = 0; k < count; ++k) chosen.push_back(all[k * all.size() / count]);
  return chosen;
}

std::vector<PlainPoint> of_pieces(const std::vector<PlainPoint>& points, uint32_t first, uint32_t last) {
  std::vector<PlainPoint> some;
  for (const PlainPoint& p : points)
    if (p.instance[0] >= first && p.instance[0] <= last) some.push_back(p);
  return some;
}

double bilinear(const Atlas& atlas, const Lightmap& map, size_t plane, uint32_t page, const DVec2& at) {
  const double x = at.x - 0.5, y = at.y - 0.5, fx = x - std::floor(x), fy = y - std::floor(y);
  double sum = 0, total = 0;
  for (int k = 0; k < 4; ++k) {
    const double tx = std::clamp(std::floor(x) + (k & 1), 0.0, atlas.width - 1.0);
    const double ty = std::clamp(std::floor(y) + (k >> 1), 0.0, atlas.height - 1.0);
    const auto t = static_cast<size_t>((page * double(atlas.height) + ty) * atlas.width + tx);
    if (!is_set(map.validity[t])) continue;
    const double w = (k & 1 ? fx : 1 - fx) * (k >> 1 ? fy : 1 - fy);
    sum += w * map.planes.data[plane][t];
    total += w;
  }
  return total > 0 ? sum / total : 0;
}

PlainSteps plain_steps(const Atlas& atlas, const Lightmap& map, const std::vector<PlainPoint>& points) {
  PlainSteps steps;
  for (const PlainPoint& p : points) {
    double e[2];
    for (int s = 0; s < 2; ++s) {
      DVec3 rgb;
      for (int c = 0; c < 3; ++c)
        rgb[c] = bilinear(atlas, map, static_cast<size_t>(c), p.page[s], p.texel[s]);
      e[s] = luminance(rgb);
    }
    if (!(e[0] + e[1] > 0)) continue;
    const double relative = std::abs(e[0] - e[1]) / (0.5 * (e[0] + e[1]));
    steps.largest = std::max(steps.largest, relative);
    steps.rms += relative * relative;
  }
  steps.rms = std::sqrt(steps.rms / static_cast<double>(points.size()));
  return steps;
}

}  // namespace kiln::test

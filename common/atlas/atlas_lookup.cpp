#include "common/atlas/atlas_lookup.h"

#include <numeric>

#include "common/base/check.h"

namespace kiln {

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
  uint32_t best = 0;
  double most = -std::numeric_limits<double>::infinity(), best1 = 0, best2 = 0;
  for (uint32_t i = parts.first[triangle]; i < parts.first[triangle + 1]; ++i) {
    const FacePart& part = charts.parts[parts.faces[i]];
    const DVec2 a(part.corner[0]), e1 = DVec2(part.corner[1]) - a, e2 = DVec2(part.corner[2]) - a;
    const DVec2 q = DVec2(b1, b2) - a;
    const double det = e1.x * e2.y - e1.y * e2.x;
    if (det == 0) continue;
    const double c1 = (q.x * e2.y - q.y * e2.x) / det, c2 = (e1.x * q.y - e1.y * q.x) / det;
    // How far inside, in the triangle's barycentrics, so that slivers do not win by their own small scale.
    const double inside = std::min({c1, c2, 1 - c1 - c2}) * std::sqrt(std::abs(det));
    if (inside > most) {
      most = inside;
      best = parts.faces[i];
      best1 = c1;
      best2 = c2;
    }
    if (std::min({c1, c2, 1 - c1 - c2}) >= 0) break;
  }
  b1 = best1;
  b2 = best2;
  return best;
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

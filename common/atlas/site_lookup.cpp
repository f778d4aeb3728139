#include "common/atlas/site_lookup.h"

#include <cmath>

namespace kiln {
namespace {

// Barycentrics of corners 1 and 2 of a part, of a point given by those of its triangle.
Vec2 within(const FacePart& part, const Vec2& b) {
  const Vec2 e1 = part.corner[1] - part.corner[0], e2 = part.corner[2] - part.corner[0],
             p = b - part.corner[0];
  const float whole = e1.x * e2.y - e1.y * e2.x;
  if (whole == 0.0f) return Vec2(1.0f / 3, 1.0f / 3);
  return Vec2(p.x * e2.y - p.y * e2.x, e1.x * p.y - e1.y * p.x) / whole;
}

}  // namespace

SiteLookup::SiteLookup(const Atlas& atlas, const Scene& scene)
    : atlas_(atlas),
      site_of_texel_(atlas.texel_count(), kNone),
      texel_size_(atlas.placements.size(), 0.0f),
      faces_(atlas.charts.size()) {
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) site_of_texel_[atlas.sites.texel[site]] = site;
  for (size_t c = 0; c < atlas.charts.size(); ++c) {
    const MeshCharts& charts = atlas.charts[c];
    if (charts.parts.empty()) continue;
    uint32_t triangles = 0;
    for (const FacePart& part : charts.parts) triangles = std::max(triangles, part.triangle + 1);
    FacesOf& of = faces_[c];
    of.first.assign(triangles + 1, 0);
    for (const FacePart& part : charts.parts) ++of.first[part.triangle + 1];
    for (uint32_t t = 0; t < triangles; ++t) of.first[t + 1] += of.first[t];
    of.face.resize(charts.parts.size());
    std::vector<uint32_t> at(of.first.begin(), of.first.end() - 1);
    for (uint32_t f = 0; f < charts.parts.size(); ++f) of.face[at[charts.parts[f].triangle]++] = f;
  }
  std::vector<double> world(atlas.placements.size(), 0), texels(atlas.placements.size(), 0);
  for (size_t i = 0; i < scene.instances.size() && i < atlas.charts_of_instance.size(); ++i) {
    const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
    const MeshCharts& charts = atlas.of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const size_t p = atlas.instance_first_chart[i] + charts.chart_of_face[f];
      Vec3 c[3];
      face_corners(mesh, charts, f, c);
      for (Vec3& v : c) v = transform_point(scene.instances[i].to_world, v);
      world[p] += double{length(cross(c[1] - c[0], c[2] - c[0]))};
      texels[p] += std::abs(area2(texel_triangle(charts, atlas.placements[p], f)));
    }
  }
  for (size_t p = 0; p < texel_size_.size(); ++p)
    if (texels[p] > 0) texel_size_[p] = static_cast<float>(std::sqrt(world[p] / texels[p]));
}

uint32_t SiteLookup::face_at(uint32_t charts, uint32_t triangle, Vec2& b) const {
  const FacesOf& of = faces_[charts];
  if (of.first.empty()) return triangle;
  if (triangle + 1 >= of.first.size()) return kNone;
  uint32_t best = kNone;
  float least = -std::numeric_limits<float>::infinity();
  Vec2 in(0.0f);
  for (uint32_t k = of.first[triangle]; k < of.first[triangle + 1]; ++k) {
    const Vec2 part = within(atlas_.charts[charts].parts[of.face[k]], b);
    const float inside = std::min({part.x, part.y, 1.0f - part.x - part.y});
    if (inside <= least) continue;
    least = inside;
    best = of.face[k];
    in = part;
  }
  b = in;
  return best;
}

SiteLookup::Place SiteLookup::find(uint32_t instance, uint32_t triangle, float b1, float b2) const {
  const uint32_t c = atlas_.charts_of_instance[instance];
  const MeshCharts& charts = atlas_.charts[c];
  Vec2 b(b1, b2);
  const uint32_t face = face_at(c, triangle, b);
  if (face >= charts.face_count()) return {};
  const Vec2* uv = &charts.corner_uv[3 * size_t{face}];
  const uint32_t placement = atlas_.instance_first_chart[instance] + charts.chart_of_face[face];
  const ChartPlacement& place = atlas_.placements[placement];
  const DVec2 at = place.to_texels(DVec2(uv[0] + b.x * (uv[1] - uv[0]) + b.y * (uv[2] - uv[0])));
  // Also false for what is not a number.
  if (!(at.x >= 0 && at.y >= 0 && at.x < atlas_.width && at.y < atlas_.height)) return {};
  const uint64_t texel = (uint64_t{place.page} * atlas_.height + static_cast<uint64_t>(at.y)) * atlas_.width +
                         static_cast<uint64_t>(at.x);
  return {site_of_texel_[texel], texel_size_[placement]};
}

}  // namespace kiln

#include "common/atlas/site_lookup.h"

#include <algorithm>
#include <cmath>

namespace kiln {
SiteLookup::SiteLookup(const Atlas& atlas, const Scene& scene)
    : atlas_(atlas),
      site_of_texel_(atlas.texel_count(), kNone),
      texel_size_(atlas.placements.size(), 0.0f),
      places_(atlas) {
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) site_of_texel_[atlas.sites.texel[site]] = site;
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
  for (size_t i = 0; i < atlas.charts_of_instance.size(); ++i) {
    float least = std::numeric_limits<float>::infinity();
    for (uint32_t p = atlas.instance_first_chart[i]; p < atlas.instance_first_chart[i + 1]; ++p)
      least = std::min(least, texel_size_[p]);
    least_texel_size_.push_back(least);
  }
}

SiteLookup::Place SiteLookup::find(uint32_t instance, uint32_t triangle, float b1, float b2) const {
  if (!places_.holds(instance, triangle)) return {};
  const AtlasPlace place = places_.at(instance, triangle, b1, b2);
  const DVec2& at = place.texels;
  // Also false for NaN.
  if (!(at.x >= 0 && at.y >= 0 && at.x < atlas_.width && at.y < atlas_.height)) return {};
  const uint64_t texel = (uint64_t{place.page} * atlas_.height + static_cast<uint64_t>(at.y)) * atlas_.width +
                         static_cast<uint64_t>(at.x);
  return {site_of_texel_[texel], texel_size_[place.placement]};
}

}  // namespace kiln

#include "coordinator/run/black_fronts.h"

#include <algorithm>
#include <cmath>

#include "common/atlas/layout.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "common/scene/record_reader.h"
#include "coordinator/bake/neighbours/site_geometry.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {
namespace {

constexpr size_t kLeastTexels = 64;   // of a chart that is worth a warning
constexpr double kBlackShare = 0.95;  // of its texels
constexpr double kBlack = 1e-3;       // of the map's mean: as good as black
constexpr double kLitShare = 0.25;    // of the rays from the back of a chart
constexpr size_t kAskedTexels = 8;    // of a chart
constexpr uint32_t kDirections = 16;
// Rays start this far behind the surface: metres, or a part of the distance from the origin if that is more.
constexpr float kOff = 1e-4f;

float light_at(const Lightmap& map, uint32_t texel) {
  return luminance(Vec3(map.planes.data[0][texel], map.planes.data[1][texel], map.planes.data[2][texel]));
}

class Backs {
 public:
  Backs(const Scene& scene, const Atlas& atlas, const Lightmap& map, float black)
      : scene_(scene), atlas_(atlas), look_(scene, atlas, map), rays_(scene), black_(black) {}

  // Whether enough of what lies behind these texels is lit.
  bool are_lit(const std::vector<uint32_t>& sites) const {
    const size_t texels = std::min(sites.size(), kAskedTexels);
    size_t asked = 0, lit = 0;
    for (size_t k = 0; k < texels; ++k) {
      PointsOnSite points(scene_, atlas_, sites[k * sites.size() / texels]);
      if (points.count() == 0) continue;
      const SitePoint point = points.at(points.count() / 2);
      if (dot(point.normal, point.normal) == 0) continue;
      const Vec3 behind = -Vec3(point.normal), position(point.position);
      const Frame frame(behind);
      const Vec3 origin = position + behind * (kOff * std::max(1.0f, length(position)));
      for (uint32_t d = 0; d < kDirections; ++d) {
        const Vec2 u((static_cast<float>(d) + 0.5f) / kDirections, unit_float(reverse_bits(d)));
        lit += meets_light(origin, frame.to_world(cosine_hemisphere(u)));
      }
      asked += kDirections;
    }
    return asked > 0 && static_cast<double>(lit) >= kLitShare * static_cast<double>(asked);
  }

 private:
  bool meets_light(const Vec3& origin, const Vec3& direction) const {
    RayHit hit;
    const auto fragment = [](const RayHit& h) {
      return Fragment{1.0f, h.instance, h.triangle, h.b1, h.b2, h.back};
    };
    if (!rays_.closest(origin, direction, 1e30f, hit,
                       [&](const RayHit& h) { return look_.solid(fragment(h)); }))
      return luminance(look_.sky(direction)) > 0;
    Vec3 e;
    return !hit.back && look_.irradiance(fragment(hit), e) && luminance(e) > black_;
  }

  const Scene& scene_;
  const Atlas& atlas_;
  const SurfaceLook look_;
  const SceneRays rays_;
  const float black_;
};

// By chart: of a double-sided material.
std::vector<uint8_t> double_sided_charts(const Scene& scene, const Atlas& atlas) {
  std::vector<uint8_t> out(atlas.placements.size());
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    if (RecordReader(scene.materials[scene.instances[i].material]).number("double_sided", 0) == 0) continue;
    std::fill(out.begin() + atlas.instance_first_chart[i], out.begin() + atlas.instance_first_chart[i + 1],
              1);
  }
  return out;
}

bool is_measured(const Lightmap& map, uint32_t texel) {
  return map.validity[texel] == Validity::kMeasured && std::isfinite(light_at(map, texel));
}

double mean_light(const Atlas& atlas, const Lightmap& map) {
  double sum = 0, count = 0;
  for (const uint32_t texel : atlas.sites.texel)
    if (is_measured(map, texel)) sum += light_at(map, texel), ++count;
  return count > 0 ? sum / count : 0;
}

struct Chart {
  size_t measured = 0;
  std::vector<uint32_t> black;  // sites
  bool is_black() const {
    return measured >= kLeastTexels &&
           static_cast<double>(black.size()) >= kBlackShare * static_cast<double>(measured);
  }
};

}  // namespace

std::string warn_of_black_fronts(const Scene& scene, const Atlas& atlas, const Lightmap& map) {
  const std::vector<uint8_t> asked = double_sided_charts(scene, atlas);
  if (std::find(asked.begin(), asked.end(), 1) == asked.end()) return {};
  const auto black = static_cast<float>(kBlack * mean_light(atlas, map));
  if (!(black > 0)) return {};
  std::vector<Chart> charts(atlas.placements.size());
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    const uint32_t texel = atlas.sites.texel[site], owner = atlas.owner[texel];
    if (owner == 0 || !asked[owner - 1] || !is_measured(map, texel)) continue;
    Chart& chart = charts[owner - 1];
    ++chart.measured;
    if (light_at(map, texel) <= black) chart.black.push_back(site);
  }
  if (std::none_of(charts.begin(), charts.end(), [](const Chart& c) { return c.is_black(); })) return {};
  const Backs backs(scene, atlas, map, black);
  std::vector<uint8_t> found(charts.size());
  parallel_for(charts.size(),
               [&](size_t p) { found[p] = charts[p].is_black() && backs.are_lit(charts[p].black); });
  std::vector<std::string> names;
  size_t texels = 0;
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    size_t of_it = 0;
    for (size_t p = atlas.instance_first_chart[i]; p < atlas.instance_first_chart[i + 1]; ++p)
      if (found[p]) of_it += charts[p].measured;
    if (of_it == 0) continue;
    names.push_back(instance_name(scene, i));
    texels += of_it;
  }
  if (names.empty()) return {};
  return text(
      "double-sided surfaces of {} are black ({} texels): their fronts face away from all light, while "
      "their backs face lit surfaces or the sky. A lightmap holds the light of the front, and both sides "
      "show it: flip the normals of these faces in the scene",
      list_names(names), texels);
}

}  // namespace kiln

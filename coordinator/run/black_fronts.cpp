#include "coordinator/run/black_fronts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/atlas/layout.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/math/frame.h"
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
constexpr int kDirections = 16;
// Rays start this far behind the surface: metres, or a part of the distance from the origin if that is more.
constexpr float kOff = 1e-4f;

float light_at(const Lightmap& map, uint32_t texel) {
  return luminance(Vec3(map.planes.data[0][texel], map.planes.data[1][texel], map.planes.data[2][texel]));
}

// Directions around +z, spread by the cosine.
std::array<Vec3, kDirections> half_space() {
  std::array<Vec3, kDirections> out;
  for (int k = 0; k < kDirections; ++k) {
    const double sine = std::sqrt((k + 0.5) / kDirections),
                 turn = 2 * std::numbers::pi * k / std::numbers::phi;
    out[static_cast<size_t>(k)] =
        Vec3(static_cast<float>(sine * std::cos(turn)), static_cast<float>(sine * std::sin(turn)),
             static_cast<float>(std::sqrt(1 - sine * sine)));
  }
  return out;
}

class Backs {
 public:
  Backs(const Scene& scene, const Atlas& atlas, const Lightmap& map, float black)
      : scene_(scene), atlas_(atlas), look_(scene, atlas, map), rays_(scene), black_(black) {}

  // Whether enough of what lies behind these texels is lit.
  bool are_lit(const std::vector<uint32_t>& sites) const {
    const std::array<Vec3, kDirections> directions = half_space();
    size_t asked = 0, lit = 0;
    for (size_t k = 0; k < std::min(sites.size(), kAskedTexels); ++k) {
      PointsOnSite points(scene_, atlas_, sites[k * sites.size() / std::min(sites.size(), kAskedTexels)]);
      if (points.count() == 0) continue;
      const SitePoint point = points.at(points.count() / 2);
      if (dot(point.normal, point.normal) == 0) continue;
      const Vec3 behind = -Vec3(point.normal), position(point.position);
      const Frame frame(behind);
      const Vec3 origin = position + behind * (kOff * std::max(1.0f, length(position)));
      for (const Vec3& d : directions) {
        ++asked;
        lit += meets_light(origin, frame.to_world(d));
      }
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

}  // namespace

std::string warn_of_black_fronts(const Scene& scene, const Atlas& atlas, const Lightmap& map) {
  struct Chart {
    size_t measured = 0;
    std::vector<uint32_t> sites;  // black ones
  };
  std::vector<uint8_t> asked(atlas.placements.size());
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const Property* sides = scene.materials[scene.instances[i].material].find("double_sided");
    if (!sides || sides->numbers.empty() || sides->numbers[0] == 0) continue;
    std::fill(asked.begin() + atlas.instance_first_chart[i],
              asked.begin() + atlas.instance_first_chart[i + 1], 1);
  }
  double sum = 0;
  size_t measured = 0;
  const auto is_measured = [&](uint32_t texel) {
    return map.validity[texel] == Validity::kMeasured && std::isfinite(light_at(map, texel));
  };
  for (const uint32_t texel : atlas.sites.texel)
    if (is_measured(texel)) sum += light_at(map, texel), ++measured;
  if (!(sum > 0)) return {};
  const auto black = static_cast<float>(kBlack * sum / static_cast<double>(measured));
  std::vector<Chart> charts(atlas.placements.size());
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    const uint32_t texel = atlas.sites.texel[site], owner = atlas.owner[texel];
    if (owner == 0 || !asked[owner - 1] || !is_measured(texel)) continue;
    Chart& chart = charts[owner - 1];
    ++chart.measured;
    if (light_at(map, texel) <= black) chart.sites.push_back(site);
  }
  const auto is_black = [](const Chart& c) {
    return c.measured >= kLeastTexels &&
           static_cast<double>(c.sites.size()) >= kBlackShare * static_cast<double>(c.measured);
  };
  if (std::none_of(charts.begin(), charts.end(), is_black)) return {};
  const Backs backs(scene, atlas, map, black);
  std::vector<uint8_t> found(charts.size());
  parallel_for(charts.size(),
               [&](size_t p) { found[p] = is_black(charts[p]) && backs.are_lit(charts[p].sites); });
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
      "{} texels are black because the fronts of their double-sided surfaces face away from the light, "
      "and lit surfaces or the sky lie behind them: {}. A lightmap holds the light of fronts, and both "
      "sides show it: flip the normals of these faces in the scene",
      texels, list_names(names));
}

}  // namespace kiln

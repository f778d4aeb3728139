#include "common/scene/scale.h"

#include <cmath>
#include <limits>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr double kHundredsOfMetres = 100, kMillimetres = 0.1;
constexpr double kManyTexels = 4e6, kFittingTexels = 1e6;
constexpr double kFewAlong = 32, kFittingAlong = 256;  // texels along the longest side

// To 1, 2 or 5 times a power of ten, downwards.
double round_number(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / unit;
  return unit * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

}  // namespace

SceneScale measure_scale(const Scene& scene) {
  Vec3 low(std::numeric_limits<float>::infinity()), high(-low);
  SceneScale scale;
  for (const Instance& i : scene.instances) {
    const Mesh& mesh = scene.meshes[i.mesh];
    for (const UVec3& t : mesh.triangles) {
      Vec3 corner[3];
      for (int k = 0; k < 3; ++k) {
        corner[k] = transform_point(i.to_world, mesh.positions[t[k]]);
        low = glm::min(low, corner[k]);
        high = glm::max(high, corner[k]);
      }
      scale.area_m2 += 0.5 * double{length(cross(corner[1] - corner[0], corner[2] - corner[0]))};
    }
  }
  if (!scene.instances.empty()) scale.widest_m = max_component(high - low);
  return scale;
}

std::string doubt_unit(const SceneScale& scale) {
  if (scale.widest_m >= kHundredsOfMetres)
    return text(
        "the scene is {:.3g} m wide; if it is {:.3g} m in centimetres, export it in metres or put it below a "
        "node "
        "of scale 0.01",
        scale.widest_m, scale.widest_m / 100);
  if (scale.widest_m > 0 && scale.widest_m <= kMillimetres)
    return text(
        "the scene is {:.3g} mm wide; if it should be {:.3g} m, export it in metres or put it below a node "
        "of scale "
        "1000",
        1000 * scale.widest_m, 1000 * scale.widest_m);
  return {};
}

std::string doubt_density(const SceneScale& scale, double texels_per_metre) {
  const std::string unit = doubt_unit(scale);
  if (unit.empty()) return {};
  const double texels = scale.area_m2 * texels_per_metre * texels_per_metre;
  const bool large = scale.widest_m >= kHundredsOfMetres;
  if (large ? texels <= kManyTexels : scale.widest_m * texels_per_metre >= kFewAlong) return {};
  const double fitting =
      round_number(large ? std::sqrt(kFittingTexels / scale.area_m2) : kFittingAlong / scale.widest_m);
  return text(
      "{}. At {:.4g} texels per metre its {:.3g} square metres make about {:.3g} million texels; "
      "--texels-per-metre {:g} makes about {:.2g} million",
      unit, texels_per_metre, scale.area_m2, texels / 1e6, fitting, scale.area_m2 * fitting * fitting / 1e6);
}

}  // namespace kiln

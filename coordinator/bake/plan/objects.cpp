#include "coordinator/bake/plan/objects.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/bake/plan/advice.h"

namespace kiln {
namespace {

struct FaceAreas {
  double world = 0, texels = 0;
};

FaceAreas face_areas(const Scene& scene, const Atlas& atlas, uint32_t instance, uint32_t face) {
  const Instance& object = scene.instances[instance];
  const MeshCharts& charts = atlas.of_instance(instance);
  Vec3 c[3];
  face_corners(scene.meshes[object.mesh], charts, face, c);
  const DVec3 a(transform_vector(object.to_world, c[1] - c[0])),
      b(transform_vector(object.to_world, c[2] - c[0]));
  const ChartPlacement& place =
      atlas.placements[atlas.instance_first_chart[instance] + charts.chart_of_face[face]];
  return {0.5 * length(cross(a, b)), 0.5 * std::abs(area2(texel_triangle(charts, place, face)))};
}

void measure(const Scene& scene, const Atlas& atlas, uint32_t instance, ObjectPlan& object) {
  double with_texels = 0, texels = 0;
  const size_t faces = atlas.of_instance(instance).face_count();
  for (uint32_t f = 0; f < faces; ++f) {
    const FaceAreas areas = face_areas(scene, atlas, instance, f);
    object.square_metres += areas.world;
    if (areas.texels > 0) with_texels += areas.world;
    texels += areas.texels;
  }
  if (with_texels > 0) object.texels_per_metre = std::sqrt(texels / with_texels);
}

}  // namespace

double face_density(const Scene& scene, const Atlas& atlas, uint32_t instance, uint32_t face) {
  const FaceAreas areas = face_areas(scene, atlas, instance, face);
  return areas.world > 0 ? std::sqrt(areas.texels / areas.world) : 0.0;
}

std::vector<ObjectPlan> plan_objects(const Scene& scene, const Atlas& atlas,
                                     const std::vector<float>& density) {
  std::vector<ObjectPlan> objects(scene.instances.size());
  parallel_for(objects.size(), [&](size_t i) {
    const Instance& instance = scene.instances[i];
    objects[i].name = instance.name;
    objects[i].mesh = scene.meshes[instance.mesh].name;
    objects[i].material = scene.materials[instance.material].name;
    objects[i].charts = atlas.instance_first_chart[i + 1] - atlas.instance_first_chart[i];
    objects[i].receive = instance.receive;
    objects[i].cast = instance.cast;
    objects[i].reflect = instance.reflect;
    objects[i].factor = density.empty() || !atlas.packed ? 1.0 : double{density[i]};
    measure(scene, atlas, static_cast<uint32_t>(i), objects[i]);
  });
  std::vector<uint32_t> instance_of(atlas.placements.size());
  for (uint32_t i = 0; i < objects.size(); ++i)
    std::fill(instance_of.begin() + atlas.instance_first_chart[i],
              instance_of.begin() + atlas.instance_first_chart[i + 1], i);
  for (const uint32_t owner : atlas.owner)
    if (owner) ++objects[instance_of[owner - 1]].texels;
  for (const uint32_t texel : atlas.sites.texel)
    if (const uint32_t owner = atlas.owner[texel]) ++objects[instance_of[owner - 1]].valid_texels;
  return objects;
}

std::string advise_density(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                           const std::vector<ObjectPlan>& objects, double seconds) {
  constexpr double kMany = 16e6, kPlenty = 2e6;
  const auto texels = static_cast<double>(atlas.sites.size());
  if (!atlas.packed || settings.texel_budget || texels <= kMany) return "";
  const double density = atlas.statistics.texels_per_metre;
  const double proposal = round_down(density * std::sqrt(kPlenty / texels));
  // Small charts do not shrink with the density, so their actual sizes are used.
  const double fewer = layout_texels(scene, atlas, settings, proposal) /
                       layout_texels(scene, atlas, settings, density) * texels;
  return text(
      "the scene is {:.3g} m wide: at {:.3g} texels per metre it takes {:.3g} million texels, at "
      "least {:.0f} minutes; --texels-per-metre {:g} would take {:.2g} million, and --max-texels finds the "
      "density for a budget. Most texels are on {}",
      widest_side(scene), density, texels / 1e6, std::ceil(seconds / 60), proposal, fewer / 1e6,
      largest_objects(objects));
}

}  // namespace kiln

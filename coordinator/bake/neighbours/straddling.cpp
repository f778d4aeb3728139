#include "coordinator/bake/neighbours/straddling.h"

#include <bit>

#include "common/atlas/site_picker.h"
#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/contact_walls.h"

namespace kiln {
namespace {

struct SurfacePoint {
  DVec3 position, normal;
};

SurfacePoint point_of(const Scene& scene, const Atlas& atlas, uint32_t site, float number) {
  const SitePick at = pick_site(atlas, site, number);
  const Instance& instance = scene.instances[at.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const UVec3& v = mesh.triangles[at.triangle];
  Vec3 p[3];
  for (int k = 0; k < 3; ++k) p[k] = transform_point(instance.to_world, mesh.positions[v[k]]);
  const Vec3 normal = normalize_or(cross(p[1] - p[0], p[2] - p[0]), Vec3(0.0f));
  return {DVec3(p[0] + (p[1] - p[0]) * at.b1 + (p[2] - p[0]) * at.b2),
          DVec3(determinant(instance.to_world) < 0 ? -normal : normal)};
}

bool straddles(const Scene& scene, const Atlas& atlas, const ContactWalls& walls, uint32_t site) {
  const uint32_t* mask = &atlas.sites.words[atlas.sites.first_word[site]];
  const int points = std::popcount(mask[0]) + std::popcount(mask[1]);
  if (points < 2) return false;
  const auto point = [&](int i) {
    return point_of(scene, atlas, site, (static_cast<float>(i) + 0.5f) / static_cast<float>(points));
  };
  const SurfacePoint first = point(0), last = point(points - 1);
  // The first and last of 64 points are a diagonal apart, and the others within half of it from the line.
  const double reach = length(last.position - first.position) + 1e-9;
  if (!walls.may_be_near(first.position, last.position, 0.75 * reach)) return false;
  for (int i = 1; i < points; ++i)
    if (walls.between(first.position, point(i).position, first.normal, reach)) return true;
  return false;
}

}  // namespace

std::vector<uint8_t> straddling_sites(const Scene& scene, const Atlas& atlas) {
  if (atlas.packed || atlas.contacts.empty()) return {};
  const ContactWalls walls(atlas.contacts);
  std::vector<uint8_t> out(atlas.sites.size());
  for_each_index(out.size(), 0, [&](size_t site) {
    out[site] = straddles(scene, atlas, walls, static_cast<uint32_t>(site));
  });
  return out;
}

}  // namespace kiln

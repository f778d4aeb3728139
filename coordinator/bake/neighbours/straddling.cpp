#include "coordinator/bake/neighbours/straddling.h"

#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/contact_walls.h"
#include "coordinator/bake/neighbours/site_geometry.h"

namespace kiln {
namespace {

bool straddles(const Scene& scene, const Atlas& atlas, const ContactWalls& walls, uint32_t site) {
  PointsOnSite points(scene, atlas, site);
  if (points.count() < 2) return false;
  const SitePoint first = points.at(0), last = points.at(points.count() - 1);
  // The first and last of 64 points are a diagonal apart, and the others within half of it from the line.
  const double reach = length(last.position - first.position) + 1e-9;
  if (!walls.may_be_near(first.position, last.position, 0.75 * reach)) return false;
  for (uint32_t i = 1; i < points.count(); ++i)
    if (walls.between(first.position, points.at(i).position, first.normal, reach)) return true;
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

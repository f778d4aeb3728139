#include "coordinator/bake/neighbours/straddling.h"

#include <bit>

#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/contact_walls.h"
#include "coordinator/bake/neighbours/site_geometry.h"

namespace kiln {
namespace {

bool straddles(const Scene& scene, const Atlas& atlas, const ContactWalls& walls, uint32_t site) {
  const uint32_t* mask = &atlas.sites.words[atlas.sites.first_word[site]];
  const int points = std::popcount(mask[0]) + std::popcount(mask[1]);
  if (points < 2) return false;
  const auto point = [&](int i) {
    return point_on_site(scene, atlas, site, (static_cast<float>(i) + 0.5f) / static_cast<float>(points));
  };
  const SitePoint first = point(0), last = point(points - 1);
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

#include "coordinator/run/first_look.h"

#include <bit>

namespace kiln {

std::vector<std::vector<uint32_t>> sites_by_look(const Atlas& atlas) {
  constexpr int kFinest = 3;  // log2 of the widest stride
  std::vector<std::vector<uint32_t>> looks(kFinest + 1);
  std::vector<uint8_t> seen(atlas.placements.size() + 1, 0);  // by chart
  const auto look_of = [&](uint32_t texel) {
    const uint32_t x = texel % atlas.width, y = texel / atlas.width % atlas.height;
    return kFinest - std::min(kFinest, std::countr_zero(x | y));
  };
  for (const uint32_t texel : atlas.sites.texel)
    if (look_of(texel) == 0) seen[atlas.owner[texel]] = 1;
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    const uint32_t texel = atlas.sites.texel[site];
    int look = look_of(texel);
    if (uint8_t& chart = seen[atlas.owner[texel]]; !chart) {
      chart = 1;
      look = 0;
    }
    looks[static_cast<size_t>(look)].push_back(site);
  }
  return looks;
}

}  // namespace kiln

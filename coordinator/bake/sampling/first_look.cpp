#include "coordinator/bake/sampling/first_look.h"

#include <bit>
#include <cstdlib>

#include "common/base/parallel.h"

namespace kiln {

std::vector<std::vector<uint32_t>> sites_by_look(const Atlas& atlas) {
  constexpr int kFinest = 3;  // log2 of the coarsest stride
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

uint32_t look_stride(size_t looks) {
  return 8u >> std::min<size_t>(looks - 1, 3);
}

void keep_stride(const Atlas& atlas, uint32_t stride, std::vector<SiteSamples>& work) {
  std::vector<uint8_t> keeps(atlas.sites.size(), 0);
  const std::vector<std::vector<uint32_t>> looks = sites_by_look(atlas);
  for (size_t look = 0; look < looks.size() && look_stride(look + 1) >= stride; ++look)
    for (const uint32_t site : looks[look]) keeps[site] = 1;
  std::erase_if(work, [&](const SiteSamples& s) { return !keeps[s.site]; });
}

void fill_between(const Atlas& atlas, std::span<const uint32_t> chart, std::span<const uint8_t> sampled,
                  uint32_t stride, IrradianceCache& cache) {
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> site_of(atlas.texel_count(), kNone);
  struct Sum {
    DVec3 light{0.0};
    double drawn[kCacheDraws] = {};
    uint32_t count = 0;
  };
  const size_t draws = cache.draws.empty() ? 0 : kCacheDraws;
  std::vector<Sum> sums(atlas.placements.size() + 1);
  const auto is_known = [&](uint32_t site) { return sampled[site] && cache.irradiance[site].x >= 0; };
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    if (!is_known(site)) continue;
    site_of[atlas.sites.texel[site]] = site;
    sums[chart[site]].light += DVec3(cache.irradiance[site]);
    ++sums[chart[site]].count;
    for (size_t k = 0; k < draws; ++k) sums[chart[site]].drawn[k] += double{cache.draws[site][k]};
  }
  const IrradianceCache before = cache;
  const auto step = static_cast<int64_t>(stride);
  for_each_index(atlas.sites.size(), 0, [&](size_t site) {
    if (sampled[site]) return;
    const int64_t texel = atlas.sites.texel[site], width = atlas.width, height = atlas.height;
    const int64_t x = texel % width, y = texel / width % height, page = texel / width / height;
    Vec3 light(0.0f);
    float weight = 0, drawn[kCacheDraws] = {};
    const int64_t near_x = (x + step / 2) / step, near_y = (y + step / 2) / step;
    for (int64_t k = 0; k < 9; ++k) {
      const int64_t u = (near_x + k % 3 - 1) * step, v = (near_y + k / 3 - 1) * step;
      if (u < 0 || v < 0 || u >= width || v >= height) continue;
      const uint32_t other = site_of[static_cast<size_t>((page * height + v) * width + u)];
      if (other == kNone || chart[other] != chart[site]) continue;
      const auto reach = static_cast<float>(2 * step);
      const float w = (1 - static_cast<float>(std::abs(u - x)) / reach) *
                      (1 - static_cast<float>(std::abs(v - y)) / reach);
      light += w * before.irradiance[other];
      weight += w;
      for (size_t k = 0; k < draws; ++k) drawn[k] += w * before.draws[other][k];
    }
    const Sum& whole = sums[chart[site]];
    if (weight > 0)
      cache.irradiance[site] = light / weight;
    else if (whole.count > 0)
      cache.irradiance[site] = Vec3(whole.light / static_cast<double>(whole.count));
    for (size_t k = 0; k < draws; ++k) {
      const double of = weight > 0        ? double{drawn[k] / weight}
                        : whole.count > 0 ? whole.drawn[k] / whole.count
                                          : 0.0;
      cache.draws[site].set(k, static_cast<float>(of));
    }
  });
}

}  // namespace kiln

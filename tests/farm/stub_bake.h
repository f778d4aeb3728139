#pragma once

#include <cmath>

#include "common/job/irradiance_cache.h"
#include "common/job/unit.h"

namespace kiln::test {

constexpr size_t kStubSites = 64;  // that a stub's cache has, however many the atlas

// Sums over samples of a pure function of (site, sample, plane, replicate, bytes of the cache).
inline UnitResult stub_bake(const WorkUnit& unit, uint32_t planes, const IrradianceCache* cache = nullptr) {
  const uint64_t hash = cache ? xxh3(write_irradiance_cache(*cache)) : 0;
  const double shift = unit.replicate * 0.7 + static_cast<double>(hash >> 40);
  UnitResult result;
  result.unit = unit.id;
  result.site_count = static_cast<uint32_t>(unit.sites.size());
  result.plane_count = planes;
  result.rays = uint64_t{unit.sample_count} * unit.sites.size();
  for (const uint32_t site : unit.sites)
    for (uint32_t p = 0; p < planes; ++p) {
      double sum = 0;
      for (uint32_t s = unit.first_sample; s < unit.first_sample + unit.sample_count; ++s)
        sum += std::fabs(std::sin(site * 0.37 + s * 1.7 + p + shift));  // between none and all of the samples
      result.moments.push_back(sum);
    }
  return result;
}

}  // namespace kiln::test

// Irradiance caches of kStubSites texels.
#pragma once

#include "tests/farm/stub_bake.h"

namespace kiln::test {

inline IrradianceCache stub_cache(uint32_t number, size_t sites = kStubSites) {
  IrradianceCache cache;
  for (size_t site = 0; site < sites; ++site)
    cache.irradiance.emplace_back(static_cast<float>(number), static_cast<float>(site), 0.5f);
  return cache;
}

}  // namespace kiln::test

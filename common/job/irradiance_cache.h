// Irradiance of every texel site, measured by one pass; in later passes a path that hits the surface may end
// there and read it. (Vandersanden 2023, the shared irradiance of earlier bounces; departure: irradiance
// rather than outgoing radiance, so that albedo keeps its own resolution.)
//
// One blob holds one replicate: replicates read only their own, so their difference includes the cache's
// error.
#pragma once

#include <span>
#include <vector>

#include "common/base/fields.h"
#include "common/math/vec.h"

namespace kiln {

struct IrradianceCache {
  // E at the front's shading normal, R G B by site. A negative first component means unknown.
  std::vector<Vec3> irradiance;
  static void fields(auto& c, auto& v) { v(c.irradiance); }
};

// Content-addressed by its bytes like every chunk.
Bytes write_irradiance_cache(const IrradianceCache& cache);
// Fails (kInvalidInput) unless there are `sites` finite entries.
Expected<IrradianceCache> read_irradiance_cache(std::span<const std::byte> bytes, size_t sites);

}  // namespace kiln

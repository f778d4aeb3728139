// What a pass leaves for the next ones: the irradiance of every texel site, which paths may read where they
// meet its surface instead of going on. (Vandersanden 2023, the shared irradiance of earlier bounces;
// departure: irradiance rather than outgoing radiance, so that albedo keeps its own resolution.)
//
// One blob holds one replicate: replicates read only their own, so that what they differ by is their error,
// the cache's included.
#pragma once

#include <span>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "common/math/vec.h"

namespace kiln {

struct IrradianceCache {
  // By site, R G B, of E at the shading normal of the front. A negative first component: not known.
  std::vector<Vec3> irradiance;
};

// Content-addressed by its bytes like every chunk.
Bytes write_irradiance_cache(const IrradianceCache& cache);
// Fails (kInvalidInput) unless there are `sites` finite entries.
Expected<IrradianceCache> read_irradiance_cache(std::span<const std::byte> bytes, size_t sites);

}  // namespace kiln

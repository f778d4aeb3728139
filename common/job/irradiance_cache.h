// Irradiance of every texel site, measured by one pass; in later passes a path that hits the surface may end
// there and read it. (Vandersanden 2023, the shared irradiance of earlier bounces; departure: irradiance
// rather than outgoing radiance, so that albedo keeps its own resolution.)
//
// One blob holds one replicate: replicates read only their own, so their difference includes the cache's
// error.
#pragma once

#include <array>
#include <bit>
#include <span>
#include <vector>

#include "common/base/fields.h"
#include "common/math/vec.h"
#include "common/responses/quantities.h"

namespace kiln {

// Errors that the luminance of a site's E may have, each drawn from their distribution: bfloat16, the upper
// half of a float.
struct CacheDraws {
  std::array<uint16_t, kCacheDraws> bits{};
  float operator[](size_t k) const { return std::bit_cast<float>(uint32_t{bits[k]} << 16); }
  void set(size_t k, float value);  // to the nearest; what is not a number becomes 0
};

struct IrradianceCache {
  // E at the front's shading normal, R G B by site. A negative first component means unknown.
  std::vector<Vec3> irradiance{};
  std::vector<CacheDraws> draws{};  // by site; empty: none
  static void fields(auto& c, auto& v) { v(c.irradiance, c.draws); }
};

// Content-addressed by its bytes like every chunk.
Bytes write_irradiance_cache(const IrradianceCache& cache);
// Fails (kInvalidInput) unless there are `sites` finite entries, and as many draws or none.
Expected<IrradianceCache> read_irradiance_cache(std::span<const std::byte> bytes, size_t sites);

}  // namespace kiln

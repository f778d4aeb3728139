#include "common/job/irradiance_cache.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln {

void CacheDraws::set(size_t k, float value) {
  constexpr float kMost = std::bit_cast<float>(0x7f7f0000u);  // the largest bfloat16
  const float kept = std::isnan(value) ? 0.0f : std::clamp(value, -kMost, kMost);
  bits[k] = static_cast<uint16_t>((std::bit_cast<uint32_t>(kept) + 0x8000u) >> 16);
}

Bytes write_irradiance_cache(const IrradianceCache& cache) {
  return write_fields(cache);
}

Expected<IrradianceCache> read_irradiance_cache(std::span<const std::byte> bytes, size_t sites) {
  KILN_TRY(IrradianceCache cache,
           read_fields<IrradianceCache>(bytes, ErrorKind::kInvalidInput, "blob of an irradiance cache"));
  if (cache.irradiance.size() != sites)
    return fail(ErrorKind::kInvalidInput, text("an irradiance cache is of {} texel sites, the atlas has {}",
                                               cache.irradiance.size(), sites));
  for (const Vec3& e : cache.irradiance)
    if (!is_finite(e)) return fail(ErrorKind::kInvalidInput, "an irradiance cache holds what is not finite");
  if (!cache.draws.empty() && cache.draws.size() != sites)
    return fail(
        ErrorKind::kInvalidInput,
        text("an irradiance cache has draws of {} texel sites, the atlas has {}", cache.draws.size(), sites));
  for (const CacheDraws& d : cache.draws)
    for (size_t k = 0; k < kCacheDraws; ++k)
      if (!std::isfinite(d[k]))
        return fail(ErrorKind::kInvalidInput, "an irradiance cache holds a draw that is not finite");
  return cache;
}

}  // namespace kiln

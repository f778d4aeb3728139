#include "common/job/irradiance_cache.h"

#include "common/base/format.h"

namespace kiln {

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
  return cache;
}

}  // namespace kiln

#include "common/job/irradiance_cache.h"

#include "common/base/format.h"

namespace kiln {

Bytes write_irradiance_cache(const IrradianceCache& cache) {
  ByteWriter w;
  w.put_array(cache.irradiance);
  return w.take();
}

Expected<IrradianceCache> read_irradiance_cache(std::span<const std::byte> bytes, size_t sites) {
  ByteReader r(bytes);
  IrradianceCache cache;
  cache.irradiance = r.get_array<Vec3>();
  if (!r.at_end()) return fail(ErrorKind::kInvalidInput, "an irradiance cache is damaged");
  if (cache.irradiance.size() != sites)
    return fail(ErrorKind::kInvalidInput, text("an irradiance cache is of {} texel sites, the atlas has {}",
                                               cache.irradiance.size(), sites));
  for (const Vec3& e : cache.irradiance)
    if (!is_finite(e)) return fail(ErrorKind::kInvalidInput, "an irradiance cache holds what is not finite");
  return cache;
}

}  // namespace kiln

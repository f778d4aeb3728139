// u32 texel sites of the atlas, then the blob of an irradiance cache.
#include <algorithm>
#include <cmath>

#include "common/job/irradiance_cache.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_irradiance(std::span<const std::byte> data) {
  ByteReader r(data);
  const auto sites = r.get<uint32_t>();
  if (!r.ok()) return;
  const auto blob = data.subspan(sizeof sites);
  const auto cache = read_irradiance_cache(blob, sites);
  require_sentence(cache);
  if (!cache) return;
  require(cache->irradiance.size() == sites, "a cache that was read has an entry for every site");
  for (const Vec3& e : cache->irradiance) require(is_finite(e), "a cache that was read is finite");
  require(cache->draws.empty() || cache->draws.size() == sites, "its draws are of every site, or none");
  for (const CacheDraws& d : cache->draws)
    for (size_t k = 0; k < kCacheDraws; ++k) require(std::isfinite(d[k]), "a draw that was read is finite");
  // It is named by its bytes: one cache must not have two names.
  const Bytes again = write_irradiance_cache(*cache);
  require(std::equal(again.begin(), again.end(), blob.begin(), blob.end()),
          "a cache that was read is written as the same bytes");
}

}  // namespace kiln::fuzz

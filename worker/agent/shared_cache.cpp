#include "worker/agent/shared_cache.h"

#include "common/base/format.h"

namespace kiln {

Expected<const IrradianceCache*> SharedCache::get() const {
  const std::lock_guard lock(mutex_);
  if (!cache_) {
    cache_ = read_irradiance_cache(*bytes_, sites_);
    bytes_.reset();
  }
  if (!*cache_) return fail(cache_->error().kind, text("chunk {}: {}", id_.hex(), cache_->error().message));
  return &**cache_;
}

}  // namespace kiln

// An irradiance cache shared by the units of a pass. The first bake thread that needs it decodes it while the
// others wait.
#pragma once

#include <mutex>
#include <optional>

#include "common/job/irradiance_cache.h"
#include "worker/agent/chunk_cache.h"

namespace kiln {

class SharedCache {
 public:
  // `sites`: texel sites of the job's atlas. The bytes are freed after decoding.
  SharedCache(const Digest& id, ChunkBytes bytes, size_t sites)
      : id_(id), sites_(sites), bytes_(std::move(bytes)) {}

  // Thread-safe. Fails (kInvalidInput) if the bytes are not a cache for this many sites.
  Expected<const IrradianceCache*> get() const;

 private:
  const Digest id_;
  const size_t sites_;
  mutable std::mutex mutex_;
  mutable ChunkBytes bytes_;
  mutable std::optional<Expected<IrradianceCache>> cache_;
};

}  // namespace kiln

// An irradiance cache that the units of a pass share. The bake thread that needs it first decodes it, the
// others wait for that one.
#pragma once

#include <mutex>
#include <optional>

#include "common/job/irradiance_cache.h"
#include "worker/agent/chunk_cache.h"

namespace kiln {

class SharedCache {
 public:
  // `sites`: texel sites of the job's atlas. The bytes are let go when they are decoded.
  SharedCache(const Digest& id, ChunkBytes bytes, size_t sites)
      : id_(id), sites_(sites), bytes_(std::move(bytes)) {}

  // Any thread. Fails (kInvalidInput) when the bytes are no cache of so many sites.
  Expected<const IrradianceCache*> get() const;

 private:
  const Digest id_;
  const size_t sites_;
  mutable std::mutex mutex_;
  mutable ChunkBytes bytes_;
  mutable std::optional<Expected<IrradianceCache>> cache_;
};

}  // namespace kiln

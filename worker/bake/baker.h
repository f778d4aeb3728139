// The worker's heart, without network or files: a scene and an atlas in, sums of radiance out.
#pragma once

#include <memory>

#include "common/atlas/atlas.h"
#include "common/job/irradiance_cache.h"
#include "common/job/unit.h"
#include "common/scene/scene.h"

namespace kiln {

class Baker {
 public:
  // Builds the ray-tracing scene, lights and materials with `threads` threads (0: all).
  static Expected<std::unique_ptr<Baker>> create(Scene scene, Atlas atlas, const TransportSettings& settings,
                                                 unsigned threads);
  virtual ~Baker() = default;
  // `cache`: what unit.cache names, or null where it names none. Fails (kInvalidInput) if the unit names a
  // site that does not exist. Reentrant: one call per thread.
  virtual Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache = nullptr) const = 0;
  virtual size_t sites() const = 0;  // of the atlas: entries of a cache
  // What a light or material record held that nothing read, one sentence each.
  virtual std::vector<std::string> warnings() const = 0;
};

// Name of this machine's numeric class for Embree kernels `isa`: "avx2-" and 16 digits of the SHA-256 of
// a small unit baked on a built-in scene. Two workers with equal names give equal bytes.
Expected<std::string> numeric_class(const std::string& isa);

}  // namespace kiln

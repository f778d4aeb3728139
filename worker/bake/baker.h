// The core of the worker, without network or files: takes a scene and an atlas, returns sums of radiance.
#pragma once

#include <memory>

#include "common/atlas/atlas.h"
#include "common/job/irradiance_cache.h"
#include "common/job/unit.h"
#include "common/probes/probe_points.h"
#include "common/scene/scene.h"

namespace kiln {

class Baker {
 public:
  // Builds the ray-tracing scene, lights and materials with `threads` threads (0: all).
  static Expected<std::unique_ptr<Baker>> create(Scene scene, Atlas atlas, const TransportSettings& settings,
                                                 unsigned threads);
  // The same of a job whose receivers are probes.
  static Expected<std::unique_ptr<Baker>> create_for_probes(Scene scene, ProbePoints probes,
                                                            const TransportSettings& settings,
                                                            unsigned threads);
  virtual ~Baker() = default;
  // `cache`: the one that unit.cache names; null if none. Fails (kInvalidInput) if the unit names a
  // site that does not exist. Reentrant: one call per thread.
  virtual Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache = nullptr) const = 0;
  virtual size_t sites() const = 0;  // in the atlas; also the number of cache entries
  // Properties of light and material records that nothing read, one sentence each.
  virtual std::vector<std::string> warnings() const = 0;
};

// Name of this machine's numeric class for Embree kernels `isa`: "avx2-" and 16 digits of the
// SHA-256 of a small built-in scene's baked unit. Two workers with equal names give equal bytes.
Expected<std::string> numeric_class(const std::string& isa);

}  // namespace kiln

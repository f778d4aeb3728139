// ROOM: add an estimator. Unidirectional path tracing with next-event estimation and multiple importance
// sampling (balance heuristic, Veach 1997 ch. 9), as seen from a texel.
//
// Each sample yields a few pairs (direction d, contribution c) that estimate radiance L(d) dw, so the sum of
// c f(d) estimates any linear functional of the incident light. Dimensions: docs/maths.md.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "common/job/unit.h"
#include "common/math/sequence.h"
#include "worker/accel/tracer.h"
#include "worker/integrators/known_irradiance.h"
#include "worker/lights/lights.h"
#include "worker/surface/surfaces.h"

namespace kiln {

// How light came to a texel.
enum class Arriving : uint32_t {
  kAlongPath,    // straight or reflected
  kDirect,       // straight from an emitter
  kDirectShare,  // the same, and in kAlongPath already; only if Quantities::direct_apart
  kHidden,  // straight from one that the texel is lit by in reflections alone; only if Quantities::all_light
};

struct RadianceSamples {
  struct RadianceSample {
    Vec3 direction, contribution;
    Arriving how;
  };
  static constexpr int kMax = 6;  // one per light strategy, and three for the path
  RadianceSamples() {}            // the items, most of it, stay uninitialised
  RadianceSample items[kMax];
  int count = 0;
  bool inside = false;  // the primary ray met a back face
  uint32_t rays = 0;
  // Errors of the cache, as radiance along `drawn_direction`; only if asked for.
  float drawn[kCacheDraws] = {};
  Vec3 drawn_direction{0.0f};
  PrimaryRay primary;  // complete if the job has responses; otherwise only the distance is set

  void add(const Vec3& direction, const Vec3& contribution, Arriving how) {
    items[count++] = {direction, contribution, how};
  }
};

// What paths of a scene can meet, known before any ray is traced. Each integrator is compiled for
// one such set and contains no branch, state or random number for features outside it.
enum Feature : uint32_t {
  kLocalLights = 1,   // lamps or emissive triangles
  kSuns = 2,          // directional lights
  kSkyImage = 4,      // an environment that is worth sampling
  kLayers = 8,        // a material that is more than a Lambert layer
  kGlass = 16,        // a material that light goes straight through
  kOneStrategy = 32,  // only one MIS strategy (MisMode): selected by settings, never by a scene
  kAreaLights = 64,   // area lights that are not surfaces; implies local lights
  kAllFeatures = 127,
};
uint32_t find_features(const Surfaces& surfaces, const Lights& lights);

class Integrator {
 public:
  // The compiled integrator with the fewest features that covers those of the scene. The arguments
  // must outlive it.
  static std::unique_ptr<Integrator> create(const Surfaces& surfaces, const Tracer& tracer,
                                            const Lights& lights, const TransportSettings& settings,
                                            uint32_t features);
  virtual ~Integrator() = default;

  // One sample of the light arriving at a surface point.
  struct Task {
    SurfacePoint receiver;
    SampleStream stream;
    RadianceSamples radiance;
  };
  // Samples go through the scene side by side, one stage at a time: a stage's code and data stay in
  // cache, memory latency overlaps, and shadow rays are traced together. The result of a sample
  // does not depend on the others in its batch.
  static constexpr size_t kBatch = 32;
  // Scratch memory of sample(); one per thread.
  class Workspace {
   public:
    virtual ~Workspace() = default;
  };
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  // At most kBatch tasks. `known`: surfaces where paths may end; may be null.
  virtual void sample(std::span<Task> tasks, Workspace& workspace,
                      const KnownIrradiance* known = nullptr) const = 0;
};

}  // namespace kiln

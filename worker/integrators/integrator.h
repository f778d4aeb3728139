// ROOM: add an estimator. Unidirectional path tracing with next-event estimation and multiple importance
// sampling (balance heuristic, Veach 1997 ch. 9), as seen from a texel.
//
// Every sample yields a few radiance (direction d, contribution c): estimates of radiance L(d) dw, so that
// any linear function of the incident light is the sum of c f(d). Dimensions: docs/maths.md.
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

struct RadianceSamples {
  struct RadianceSample {
    Vec3 direction, contribution;
  };
  static constexpr int kMax = 4;  // one for each light strategy and one for the path
  RadianceSample items[kMax];
  int count = 0;
  bool inside = false;  // the primary ray met a back face
  uint32_t rays = 0;
  PrimaryRay primary;  // complete where the job has responses, else its distance alone

  void add(const Vec3& direction, const Vec3& contribution) { items[count++] = {direction, contribution}; }
};

// What paths of a scene can meet, found before a ray is traced. An integrator is compiled for each set, and
// holds nothing else: no branch, no state, no random number of what is not there.
enum Feature : uint32_t {
  kLocalLights = 1,   // lamps or emissive triangles
  kSuns = 2,          // directional lights
  kSkyImage = 4,      // an environment that is worth sampling
  kLayers = 8,        // a material that is more than a Lambert layer
  kGlass = 16,        // a material that light goes straight through
  kOneStrategy = 32,  // other MisMode than both: of no scene, asked for by settings
  kAreaLights = 64,   // local lights that have a shape but are no surfaces; there are local lights then
  kAllFeatures = 127,
};
uint32_t find_features(const Surfaces& surfaces, const Lights& lights);

class Integrator {
 public:
  // The integrator of the fewest compiled features that has all those of the scene, or the one that has all.
  // What it is made of outlives it.
  static std::unique_ptr<Integrator> create(const Surfaces& surfaces, const Tracer& tracer,
                                            const Lights& lights, const TransportSettings& settings,
                                            uint32_t features);
  virtual ~Integrator() = default;

  // One sample of the light that arrives at a surface point.
  struct Task {
    SurfacePoint receiver;
    SampleStream stream;
    RadianceSamples radiance;
  };
  // Samples that go through the scene side by side, stage by stage: one stage's code and data stay warm, one
  // sample waits for memory while the others are worked on, and shadow rays are traced together. What a
  // sample gives does not depend on which others share its batch.
  static constexpr size_t kBatch = 32;
  // What sample() works in; one for each thread that calls it.
  class Workspace {
   public:
    virtual ~Workspace() = default;
  };
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  // At most kBatch tasks. `known`: where paths may end; null: nowhere.
  virtual void sample(std::span<Task> tasks, Workspace& workspace,
                      const KnownIrradiance* known = nullptr) const = 0;
};

}  // namespace kiln

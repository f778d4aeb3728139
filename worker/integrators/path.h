// ROOM: add an estimator. Unidirectional path tracing with next-event estimation and multiple importance
// sampling (balance heuristic, Veach 1997 ch. 9), as seen from a texel.
//
// Every sample yields a few splats (direction d, contribution c): estimates of radiance L(d) dw, so that
// any linear function of the incident light is the sum of c f(d). Dimensions: docs/maths.md.
#pragma once

#include <cstdint>
#include <span>

#include "common/job/unit.h"
#include "common/math/sequence.h"
#include "worker/accel/tracer.h"
#include "worker/lights/lights.h"
#include "worker/surface/surfaces.h"

namespace kiln {

struct Splats {
  struct Splat {
    Vec3 direction, contribution;
  };
  static constexpr int kMost = 4;  // one for each light strategy and one for the path
  Splat items[kMost];
  int count = 0;
  bool inside = false;  // the primary ray met a back face
  uint32_t rays = 0;

  void add(const Vec3& direction, const Vec3& contribution) { items[count++] = {direction, contribution}; }
};

class PathIntegrator {
 public:
  PathIntegrator(const Surfaces& surfaces, const Tracer& tracer, const Lights& lights,
                 const TransportSettings& settings)
      : surfaces_(surfaces), tracer_(tracer), lights_(lights), settings_(settings) {}

  // One sample of the light that arrives at a surface point.
  struct Task {
    SurfacePoint receiver;
    SampleStream stream;
    Splats splats;
  };
  // Samples that go through the scene side by side: while one waits for memory the others are worked on.
  // What a sample gives does not depend on which others share its batch.
  static constexpr size_t kBatch = 16;
  void sample(std::span<Task> tasks) const;  // at most kBatch

 private:
  struct Vertex;
  struct Path;
  void direct(const Vertex& v, const SampleStream& stream, uint32_t bounces, Splats& out,
              Vec3* reflected) const;
  void light(const Vertex& v, const LightSample& s, uint32_t bounces, Splats& out, Vec3* reflected) const;
  bool start(Path& path, Task& task) const;
  void trace(Path& path) const;
  bool arrive(Path& path) const;
  bool continues(Path& path) const;
  bool passes_glass(Path& path, const Bsdf& layers) const;
  // Radiance of the emissive surface that was hit or of the environment, weighted against light sampling.
  Vec3 emitted(const Path& path) const;
  Vec3 missed(const Vec3& direction, float pdf, uint32_t bounces) const;
  bool may_reflect(uint32_t bounces) const { return settings_.indirect && bounces < settings_.max_bounces; }
  // Does light count that was reflected this often?
  bool counts(uint32_t bounces) const { return bounces == 0 ? settings_.direct : settings_.indirect; }

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  const Lights& lights_;
  const TransportSettings& settings_;
};

}  // namespace kiln

// Rays against the scene. Meshes used once are put into one flat tree in world space; meshes used more
// often are kept once and instanced.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/scene/scene.h"

namespace kiln {

struct Ray {
  Vec3 origin, direction;  // direction need not be unit
  float far = 0x1.fffffep127f;
};

struct Hit {
  uint32_t instance = ~0u, triangle = 0;
  float b1 = 0, b2 = 0;  // barycentrics of vertices 1 and 2
  float t = 0;           // in lengths of the direction
  bool valid() const { return instance != ~0u; }
};

// What surfaces let through. Coverage (alpha) is looked at by all rays. Glass is a surface that paths meet
// and pass by a decision of their own; only shadow rays look through it here.
class Transparency {
 public:
  virtual ~Transparency() = default;
  virtual bool has_alpha(uint32_t instance) const = 0;  // may opacity() be below 1?
  virtual bool is_glass(uint32_t instance) const = 0;   // may pass() change anything?
  // Coverage in [0, 1].
  virtual float opacity(uint32_t instance, uint32_t triangle, float b1, float b2) const = 0;
  // Light that goes straight on: `factor` of it where the surface covers, and `absorption` (1/m) of the
  // medium that a ray along `direction` (unit) enters or leaves.
  struct Pass {
    Vec3 factor{0.0f}, absorption{0.0f};
    bool enters = false;
  };
  virtual Pass pass(uint32_t instance, uint32_t triangle, float b1, float b2,
                    const Vec3& direction) const = 0;
};

class Tracer {
 public:
  // `watertight`: Embree's robust mode, in which no ray passes between triangles that share an edge.
  // `scene` and `transparency` outlive the tracer. Fails (kInvalidInput) when this processor lacks `isa`, and
  // (kInternal) on any Embree error.
  static Expected<std::unique_ptr<Tracer>> create(const Scene& scene, const Transparency& transparency,
                                                  const std::string& isa, unsigned threads,
                                                  bool watertight = false);
  virtual ~Tracer() = default;

  // Nearest surface. A partly opaque point is met with the probability of its opacity, decided by a hash
  // of `key` and the triangle: independent of the order of traversal.
  virtual Hit intersect(const Ray& ray, uint32_t key) const = 0;
  // Share of light that passes along the ray: what is not covered, what glass lets straight through, what its
  // inside does not absorb; 0 behind an opaque surface.
  virtual Vec3 transmittance(const Ray& ray) const = 0;
  // The same of many rays: passed[i] of rays[i]. Faster where neighbours in the list run alike.
  virtual void transmittance(std::span<const Ray> rays, Vec3* passed) const = 0;
  virtual size_t memory_bytes() const = 0;
};

// Origin of a ray that leaves a surface point on the side of n: moved by `error`, a bound on how far
// rounding can put the point or the intersection off the surface. No scene-scale epsilon.
inline Vec3 offset_origin(const Vec3& p, const Vec3& n, float error) {
  return p + n * error;
}

}  // namespace kiln

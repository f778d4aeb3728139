// Traces rays against the scene. Meshes used once share one flat tree in world space; meshes used more often
// are stored once and instanced.
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

// Transparency of surfaces. Coverage (alpha) applies to all rays. Paths hit glass as a surface and choose to
// refract themselves; only shadow rays pass through it here.
class Transparency {
 public:
  virtual ~Transparency() = default;
  virtual bool has_alpha(uint32_t instance) const = 0;  // whether opacity() may be below 1
  virtual bool is_glass(uint32_t instance) const = 0;   // whether pass() may have an effect
  // Coverage in [0, 1].
  virtual float opacity(uint32_t instance, uint32_t triangle, float b1, float b2) const = 0;
  // Straight transmission: the `factor` transmitted where the surface covers, and the `absorption` (1/m) of
  // the medium that a ray along `direction` (unit) enters or leaves.
  struct Pass {
    Vec3 factor{0.0f}, absorption{0.0f};
    bool enters = false;
  };
  virtual Pass pass(uint32_t instance, uint32_t triangle, float b1, float b2,
                    const Vec3& direction) const = 0;
};

class Tracer {
 public:
  // `watertight`: Embree's robust mode, in which no ray slips between triangles that share an edge.
  // `scene` and `transparency` outlive the tracer. Fails (kInvalidInput) if this processor lacks `isa`, and
  // (kInternal) on any Embree error.
  static Expected<std::unique_ptr<Tracer>> create(const Scene& scene, const Transparency& transparency,
                                                  const std::string& isa, unsigned threads,
                                                  bool watertight = false);
  virtual ~Tracer() = default;

  // Traces to the nearest surface. A partly opaque point is hit with the probability of its opacity, decided
  // by a hash of `key` and the triangle, so independent of traversal order.
  virtual Hit intersect(const Ray& ray, uint32_t key) const = 0;
  // Transmittance along the ray: the uncovered share, times straight transmission through glass, times
  // absorption inside it; 0 behind an opaque surface.
  virtual Vec3 transmittance(const Ray& ray) const = 0;
  // The same for many rays: passed[i] for rays[i]. Faster if neighbouring rays are coherent.
  virtual void transmittance(std::span<const Ray> rays, Vec3* passed) const = 0;
  virtual size_t memory_bytes() const = 0;
};

// Origin of a ray that leaves a surface point on the side of n: offset by `error`, a bound on the rounding of
// the point and of the intersection. No scene-scale epsilon.
inline Vec3 offset_origin(const Vec3& p, const Vec3& n, float error) {
  return p + n * error;
}

}  // namespace kiln

// Lights inside the scene: points, spots and emissive triangles, chosen by power, or by power over
// distance where they are few enough to look at each.
#pragma once

#include <variant>

#include "common/math/discrete.h"
#include "worker/lights/punctual.h"
#include "worker/surface/surfaces.h"

namespace kiln {

class LocalLights {
 public:
  // Finds the emissive triangles of the scene. Add the punctual lights first, then finish.
  template <class Light>
  void add(Light light) {
    if (light.bake != BakeMode::kNone && light.power() > 0.0f) punctual_.push_back(light);
  }
  void finish(const Surfaces& surfaces);
  bool empty() const { return punctual_.empty() && triangles_.empty(); }
  size_t size() const { return punctual_.size() + triangles_.size(); }

  // Which of its numbers sample() reads: none to choose one light of one, none for a point on a punctual
  // light.
  bool wants_choice() const { return size() > 1; }
  bool wants_point() const { return !triangles_.empty(); }
  // `n` is the receiver's unit normal; light that arrives from below it is of no use.
  LightSample sample(const Surfaces& surfaces, const Vec3& p, const Vec3& n, float u_light,
                     const Vec2& u) const;
  // Density with which sample() at (p, n) finds the point of an emissive triangle that a unit ray met at
  // distance `t` under an angle of cosine `cos_light`; 0 if it is none.
  float pdf(const Vec3& p, const Vec3& n, uint32_t instance, uint32_t triangle, float cos_light,
            float t) const;

 private:
  using Punctual = std::variant<PointLight, SpotLight>;  // the roster
  struct Emitter {
    uint32_t instance, triangle;
    Vec3 centre;
    float radius2, area, power;
    float strength;  // power / 4 pi
  };
  void add_emitters(const Surfaces& surfaces, uint32_t instance);
  float importance(size_t light, const Vec3& p) const;
  // Chosen light and its probability at p.
  std::pair<uint32_t, float> choose(const Vec3& p, float u) const;
  float probability(size_t light, const Vec3& p) const;
  LightSample sample_triangle(const Surfaces& surfaces, const Emitter& e, const Vec3& p, const Vec2& u) const;

  std::vector<Punctual> punctual_;
  std::vector<Emitter> triangles_;
  std::vector<uint32_t> first_emitter_;  // by instance: index of its first triangle in emitter_of_
  std::vector<uint32_t> emitter_of_;     // by triangle of emissive instances; ~0: does not shine
  DiscreteDistribution by_power_;
};

}  // namespace kiln

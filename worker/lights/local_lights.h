// Lights inside the scene: points, spots, IES profiles and emissive triangles, of which a light tree chooses
// one.
#pragma once

#include <variant>

#include "common/math/discrete.h"
#include "worker/lights/ies.h"
#include "worker/lights/light_tree.h"
#include "worker/lights/punctual.h"
#include "worker/surface/surfaces.h"

namespace kiln {

// How one light of many is chosen. The tree is what bakes use; tests and benchmarks compare it with the
// others.
enum class LightChoice { kTree, kPower, kUniform };

class LocalLights {
 public:
  // Finds the emissive triangles of the scene. Add the punctual lights first, then finish.
  template <class Light>
  void add(Light light) {
    if (light.bake != BakeMode::kNone && light.power() > 0.0) punctual_.push_back(light);
  }
  void finish(const Surfaces& surfaces, LightChoice choice = LightChoice::kTree);
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
  // With which sample() at (p, n) chooses a light: punctual ones in the order of add(), then triangles.
  float probability_of(uint32_t light, const Vec3& p, const Vec3& n) const;

 private:
  using Punctual = std::variant<PointLight, SpotLight, IesLight>;  // the roster
  struct Emitter {
    uint32_t instance, triangle;
    float area;
  };
  void add_emitters(const Surfaces& surfaces, uint32_t instance, std::vector<LightBounds>& bounds);
  LightTree::Choice choose(const Vec3& p, const Vec3& n, float u) const;
  LightSample sample_triangle(const Surfaces& surfaces, const Emitter& e, const Vec3& p, const Vec2& u) const;

  std::vector<Punctual> punctual_;
  std::vector<Emitter> triangles_;       // lights after the punctual ones
  std::vector<uint32_t> first_emitter_;  // by instance: index of its first triangle in emitter_of_
  std::vector<uint32_t> emitter_of_;     // by triangle of emissive instances; ~0: does not shine
  LightChoice choice_ = LightChoice::kTree;
  LightTree tree_;
  DiscreteDistribution fixed_;  // of the other choices
};

}  // namespace kiln

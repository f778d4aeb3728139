// Lights inside the scene: those of the roster and emissive triangles, of which a light tree chooses one.
#pragma once

#include "common/math/discrete.h"
#include "worker/lights/light_roster.h"
#include "worker/lights/light_tree.h"
#include "worker/surface/surfaces.h"

namespace kiln {

// How one light of many is chosen. The tree is what bakes use; tests and benchmarks compare it with the
// others.
enum class LightChoice { kTree, kPower, kUniform };

class LocalLights {
 public:
  // Parses a light of the roster; false where the record's type is none of them. Lights that give nothing are
  // left out. Errors: those of the type.
  Expected<bool> add(RecordReader& r, const Record& record, const Scene& scene);
  // After the last add: finds the emissive triangles of the scene.
  void finish(const Surfaces& surfaces, LightChoice choice = LightChoice::kTree);
  bool empty() const { return lights_.empty() && triangles_.empty(); }
  size_t size() const { return lights_.size() + triangles_.size(); }
  bool has_area_lights() const { return !area_lights_.empty(); }

  // Which of its numbers sample() reads: none to choose one light of one, none for a point on a delta light.
  bool wants_choice() const { return size() > 1; }
  bool wants_point() const { return !triangles_.empty() || has_area_lights(); }
  // `n` is the receiver's unit normal; light that arrives from below it is of no use.
  LightSample sample(const Surfaces& surfaces, const Vec3& p, const Vec3& n, float u_light,
                     const Vec2& u) const;
  // Density with which sample() at (p, n) finds the point of an emissive triangle that a unit ray met at
  // distance `t` under an angle of cosine `cos_light`; 0 if it is none.
  float pdf(const Vec3& p, const Vec3& n, uint32_t instance, uint32_t triangle, float cos_light,
            float t) const;
  // With which sample() at (p, n) chooses a light: those of the roster in the order of add(), then triangles.
  float probability_of(uint32_t light, const Vec3& p, const Vec3& n) const;

  // A piece of a ray that left a receiver along a unit direction, between two distances from `origin`,
  // metres. `origin` is on the ray, but for the offsets from surfaces.
  struct Segment {
    Vec3 origin, direction;
    double from, to;
  };
  // An area light on it.
  struct Crossing {
    Vec3 radiance;
    double distance;  // from the segment's origin
    float pdf;        // density with which sample() at (p, n) finds it, with the choice of light; 0: never
    bool indirect_only;
  };
  // Visits the area lights that the segment of a ray from p crosses. They hide neither each other nor
  // anything else. Looks at each light in turn.
  template <class Visitor>
  void for_each_crossing(const Vec3& p, const Vec3& n, const Segment& segment, const Visitor& visit) const {
    for (const uint32_t light : area_lights_)
      if (const auto c = crossing(light, p, n, segment)) visit(*c);
  }

 private:
  struct Emitter {
    uint32_t instance, triangle;
    float area;
  };
  void add_emitters(const Surfaces& surfaces, uint32_t instance, std::vector<LightBounds>& bounds);
  LightTree::Choice choose(const Vec3& p, const Vec3& n, float u) const;
  LightSample sample_triangle(const Surfaces& surfaces, const Emitter& e, const Vec3& p, const Vec2& u) const;
  std::optional<Crossing> crossing(uint32_t light, const Vec3& p, const Vec3& n,
                                   const Segment& segment) const;

  std::vector<AnyLight> lights_;
  std::vector<uint32_t> area_lights_;    // those of lights_ that are no delta lights
  std::vector<Emitter> triangles_;       // lights after those of the roster
  std::vector<uint32_t> first_emitter_;  // by instance: index of its first triangle in emitter_of_
  std::vector<uint32_t> emitter_of_;     // by triangle of emissive instances; ~0: does not shine
  LightChoice choice_ = LightChoice::kTree;
  LightTree tree_;
  DiscreteDistribution fixed_;  // of the other choices
};

}  // namespace kiln

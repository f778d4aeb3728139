// Lights inside the scene: roster lights and emissive triangles. A light tree chooses one of them.
#pragma once

#include "common/math/discrete.h"
#include "worker/lights/light_roster.h"
#include "worker/lights/light_tree.h"
#include "worker/surface/surfaces.h"

namespace kiln {

// How one of many lights is chosen. Bakes use the tree; tests and benchmarks compare it with the
// others.
enum class LightChoice { kTree, kPower, kUniform };

class LocalLights {
 public:
  // Parses a roster light; false if the record has another type. Lights without power are skipped.
  // Errors: those of the type.
  Expected<bool> add(RecordReader& r, const Record& record, const Scene& scene);
  // Call after the last add(): collects the emissive triangles of the scene.
  void finish(const Surfaces& surfaces, LightChoice choice = LightChoice::kTree);
  bool empty() const { return lights_.empty() && triangles_.empty(); }
  size_t size() const { return lights_.size() + triangles_.size(); }
  bool has_area_lights() const { return !area_lights_.empty(); }

  // The random numbers sample() reads: no choice with one light, no point on a delta light.
  bool wants_choice() const { return size() > 1; }
  bool wants_point() const { return !triangles_.empty() || has_area_lights(); }
  // `n` is the receiver's unit normal; light from below it is ignored.
  LightSample sample(const Surfaces& surfaces, const Vec3& p, const Vec3& n, float u_light,
                     const Vec2& u) const;
  // Density with which sample() at (p, n) draws the point of an emissive triangle that a unit ray
  // hit at distance `t` with cosine `cos_light`; 0 if the triangle does not emit.
  float pdf(const Vec3& p, const Vec3& n, uint32_t instance, uint32_t triangle, float cos_light,
            float t) const;
  // Probability of each light for sample() at (p, n): roster lights in the order of add(), then triangles.
  float probability_of(uint32_t light, const Vec3& p, const Vec3& n) const;

  // A piece of a ray that left a receiver along a unit direction, between two distances in metres
  // from `origin`, which lies on the ray up to surface offsets.
  struct Segment {
    Vec3 origin, direction;
    double from, to;
  };
  // An area light that the segment crosses.
  struct Crossing {
    Vec3 radiance;
    double distance;  // from the segment's origin
    float pdf;        // density of sample() at (p, n), including the choice of light; 0: never drawn
    bool indirect_only;
  };
  // Visits the area lights that a ray segment from p crosses. They hide neither each other nor
  // anything else. Linear in the number of area lights.
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
  std::vector<uint32_t> area_lights_;    // the lights_ that are not delta lights
  std::vector<Emitter> triangles_;       // numbered after the roster's lights
  std::vector<uint32_t> first_emitter_;  // by instance: index of its first triangle in emitter_of_
  std::vector<uint32_t> emitter_of_;     // by triangle of emissive instances; ~0: does not emit
  LightChoice choice_ = LightChoice::kTree;
  LightTree tree_;
  DiscreteDistribution fixed_;  // distribution for the other choices
};

}  // namespace kiln

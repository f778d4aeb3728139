// Directional lights: delta, or a disc of uniform radiance with a given angular diameter.
#pragma once

#include "common/math/discrete.h"
#include "common/math/frame.h"
#include "common/scene/record_reader.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class DirectionalLights {
 public:
  static constexpr std::string_view kType = "directional";
  void add(RecordReader& r, const Mat4x3& to_world);
  void finish();  // after the last add
  bool empty() const { return lights_.empty(); }
  // Whether light may arrive on the side of the unit normal n. Never false if it can.
  bool may_light(const Vec3& n) const { return lights_.size() > 1 || dot(n, only_direction_) > least_cos_; }
  // The random numbers sample() reads: no choice with one light, no point on a delta light.
  bool wants_choice() const { return lights_.size() > 1; }
  bool wants_point() const { return any_disc_; }
  LightSample sample(float u_light, const Vec2& u) const;

 private:
  struct Light {
    Frame frame;  // around the direction to the light
    Vec3 weight;  // irradiance (delta) or radiance / pdf (disc), divided by the probability of the choice
    Vec3 irradiance;
    float h;  // 1 - cos(half angle); 0: delta
    bool indirect_only;
  };
  std::vector<Light> lights_;
  DiscreteDistribution choice_;
  bool any_disc_ = false;
  Vec3 only_direction_{0.0f};
  float least_cos_ =
      0.0f;  // cosine of the angle to n beyond which the first light's disc is below the horizon of n
};

}  // namespace kiln

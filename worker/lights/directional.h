// Directional lights: delta, or a disc of uniform radiance of a given angular diameter.
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
  // Can light arrive on the side of the unit normal n? Never wrong when it says no.
  bool may_light(const Vec3& n) const { return lights_.size() > 1 || dot(n, only_direction_) > least_cos_; }
  // Which of its numbers sample() reads: none to choose one light of one, none for a point on a delta light.
  bool wants_choice() const { return lights_.size() > 1; }
  bool wants_point() const { return any_disc_; }
  LightSample sample(float u_light, const Vec2& u) const;

 private:
  struct Light {
    Frame frame;  // around the direction to the light
    Vec3 weight;  // irradiance x what the disc's density makes of it / probability of the choice
    Vec3 irradiance;
    float h;  // 1 - cos(half angle); 0: delta
    bool indirect_only;
  };
  std::vector<Light> lights_;
  DiscreteDistribution choice_;
  bool any_disc_ = false;
  Vec3 only_direction_{0.0f};
  float least_cos_ =
      0.0f;  // of the angle between n and the first light at which its disc is below n's horizon
};

}  // namespace kiln

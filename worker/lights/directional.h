// Directional lights: delta, or a disc of uniform radiance of a given angular diameter.
#pragma once

#include "common/math/discrete.h"
#include "common/scene/record_reader.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class DirectionalLights {
 public:
  static constexpr std::string_view kType = "directional";
  void add(RecordReader& r, const Mat4x3& to_world);
  void finish();  // after the last add
  bool empty() const { return lights_.empty(); }
  LightSample sample(float u_light, const Vec2& u) const;

 private:
  struct Light {
    Vec3 to_light, irradiance;
    float h;  // 1 - cos(half angle); 0: delta
    bool indirect_only;
  };
  std::vector<Light> lights_;
  DiscreteDistribution choice_;
};

}  // namespace kiln

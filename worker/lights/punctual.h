// KHR_lights_punctual point and spot. I cos / d^2 with the extension's recommended range window.
#pragma once

#include "common/scene/record_reader.h"
#include "worker/lights/light_bounds.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class PointLight {
 public:
  static constexpr std::string_view kType = "point";
  static PointLight parse(RecordReader& r, const Mat4x3& to_world);
  // Irradiance on a facing surface at p.
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return position_; }
  double power() const;  // integral of the radiant intensity over all directions, luminance
  LightBounds bounds() const;
  BakeMode bake = BakeMode::kFull;

 private:
  friend class SpotLight;
  friend class IesLight;
  Vec3 position_, intensity_;
  float range_ = 0.0f;  // 0: no limit
};

class SpotLight {
 public:
  static constexpr std::string_view kType = "spot";
  static SpotLight parse(RecordReader& r, const Mat4x3& to_world);
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return point_.position(); }
  double power() const;
  LightBounds bounds() const;
  BakeMode bake = BakeMode::kFull;

 private:
  float cone(const Vec3& p) const;
  PointLight point_;
  Vec3 axis_;
  double inner_ = 0.0, outer_ = 0.0;     // half angles, radians
  double h_outer_ = 0.0;                 // 1 - cos(outer), which does not cancel for narrow cones
  float outer_f_ = 0.0f, scale_ = 0.0f;  // attenuation is the square of (h_outer - h) x scale in [0, 1]
};

BakeMode parse_bake(RecordReader& r);

}  // namespace kiln

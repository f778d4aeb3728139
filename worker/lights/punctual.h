// KHR_lights_punctual point and spot. I cos / d^2 with the extension's recommended range window.
#pragma once

#include "common/scene/record_reader.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class PointLight {
 public:
  static constexpr std::string_view kType = "point";
  static PointLight parse(RecordReader& r, const Mat4x3& to_world);
  // Irradiance on a facing surface at p.
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return position_; }
  float power() const;  // mean radiant intensity x 4 pi, luminance; for choosing among lights
  BakeMode bake = BakeMode::kFull;

 private:
  friend class SpotLight;
  Vec3 position_, intensity_;
  float range_ = 0.0f;  // 0: no limit
};

class SpotLight {
 public:
  static constexpr std::string_view kType = "spot";
  static SpotLight parse(RecordReader& r, const Mat4x3& to_world);
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return point_.position(); }
  float power() const;
  BakeMode bake = BakeMode::kFull;

 private:
  float cone(const Vec3& p) const;
  PointLight point_;
  Vec3 axis_;
  float scale_ = 0.0f, offset_ = 0.0f;  // of the specification's angular attenuation
  float cos_outer_ = 0.0f;
};

BakeMode parse_bake(RecordReader& r);

}  // namespace kiln

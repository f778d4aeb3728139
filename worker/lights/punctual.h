// KHR_lights_punctual point and spot. I cos / d^2 with the extension's recommended range window.
#pragma once

#include "common/base/status.h"
#include "common/scene/record_reader.h"
#include "worker/lights/light_bounds.h"
#include "worker/lights/light_sample.h"

namespace kiln {

// The only direction in which a light without an area can be sampled.
template <class Light>
LightSample delta_sample(const Light& light, const Vec3& p) {
  LightSample s;
  s.segment = light.position() - p;
  s.direction = normalize_or(s.segment, Vec3(0, 1, 0));
  s.weight = light.irradiance(p);
  return s;
}

class PointLight {
 public:
  static constexpr std::string_view kType = "point";
  static constexpr bool kDelta = true;
  static PointLight parse(RecordReader& r, const Mat4x3& to_world);
  static Expected<PointLight> parse(RecordReader& r, const Record& record, const Scene&) {
    return parse(r, record.to_world);
  }
  LightSample sample(const Vec3& p, const Vec2&) const { return delta_sample(*this, p); }
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
  float range_ = 0.0f;  // metres; 0: no limit
};

class SpotLight {
 public:
  static constexpr std::string_view kType = "spot";
  static constexpr bool kDelta = true;
  static SpotLight parse(RecordReader& r, const Mat4x3& to_world);
  static Expected<SpotLight> parse(RecordReader& r, const Record& record, const Scene&) {
    return parse(r, record.to_world);
  }
  LightSample sample(const Vec3& p, const Vec2&) const { return delta_sample(*this, p); }
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

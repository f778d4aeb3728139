#include "worker/lights/punctual.h"

namespace kiln {

BakeMode parse_bake(RecordReader& r) {
  const std::string word = r.word("bake", "full");
  return word == "none" ? BakeMode::kNone : word == "indirect" ? BakeMode::kIndirect : BakeMode::kFull;
}

PointLight PointLight::parse(RecordReader& r, const Mat4x3& to_world) {
  PointLight l;
  l.position_ = to_world[3];
  l.intensity_ = glm::max(r.vec3("color", Vec3(1.0f)) * r.number("intensity", 1.0f), Vec3(0.0f));
  l.range_ = std::max(0.0f, r.number("range", 0.0f));
  l.bake = parse_bake(r);
  return l;
}

Vec3 PointLight::irradiance(const Vec3& p) const {
  const Vec3 d = position_ - p;
  const float d2 = dot(d, d);
  if (!(d2 > 0.0f)) return Vec3(0.0f);
  float window = 1.0f;
  if (range_ > 0.0f) {
    const float q = d2 / (range_ * range_);
    window = std::clamp(1.0f - q * q, 0.0f, 1.0f);
  }
  return intensity_ * (window / d2);
}

float PointLight::power() const {
  return 4.0f * kPi * luminance(intensity_);
}

SpotLight SpotLight::parse(RecordReader& r, const Mat4x3& to_world) {
  SpotLight l;
  l.point_ = PointLight::parse(r, to_world);
  l.bake = l.point_.bake;
  l.axis_ = normalize_or(-to_world[2], Vec3(0, 0, -1));
  const double inner = std::clamp<double>(r.number("inner", 0.0f), 0.0, 1.5707963267948966);
  const double outer = std::clamp<double>(r.number("outer", 0.78539816f), inner, 1.5707963267948966);
  // KHR_lights_punctual, "Inner and Outer Cone Angles". Cosines in double, rounded once.
  const double scale = 1.0 / std::max(0.001, std::cos(inner) - std::cos(outer));
  l.scale_ = static_cast<float>(scale);
  l.offset_ = static_cast<float>(-std::cos(outer) * scale);
  l.cos_outer_ = static_cast<float>(std::cos(outer));
  return l;
}

float SpotLight::cone(const Vec3& p) const {
  const float c = dot(normalize_or(p - position(), axis_), axis_);
  const float t = std::clamp(c * scale_ + offset_, 0.0f, 1.0f);
  return t * t;
}

Vec3 SpotLight::irradiance(const Vec3& p) const {
  return point_.irradiance(p) * cone(p);
}

float SpotLight::power() const {
  return point_.power() * 0.5f * (1.0f - cos_outer_);
}

}  // namespace kiln

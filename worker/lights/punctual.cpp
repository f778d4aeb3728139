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

double PointLight::power() const {
  return 4.0 * M_PI * luminance(DVec3(intensity_));
}

LightBounds PointLight::bounds() const {
  LightBounds b;
  b.centre = position_;
  b.strength = luminance(DVec3(intensity_));
  if (range_ > 0.0f) b.reach = range_;
  return b;
}

SpotLight SpotLight::parse(RecordReader& r, const Mat4x3& to_world) {
  constexpr double kHalfPi = 1.57079632679489661923;
  SpotLight l;
  l.point_ = PointLight::parse(r, to_world);
  l.bake = l.point_.bake;
  l.axis_ = normalize_or(-to_world[2], Vec3(0, 0, -1));
  l.outer_ = std::clamp<double>(r.number("outer", 0.78539816f), 0.0, kHalfPi);
  l.inner_ = std::clamp<double>(r.number("inner", 0.0f), 0.0, l.outer_);
  // KHR_lights_punctual, "Inner and Outer Cone Angles", with 1 - cos = 2 sin^2(half the angle).
  const auto versine = [](double angle) { return 2.0 * std::sin(0.5 * angle) * std::sin(0.5 * angle); };
  l.h_outer_ = versine(l.outer_);
  l.outer_f_ = static_cast<float>(l.h_outer_);
  l.scale_ = static_cast<float>(1.0 / std::max(0.001, l.h_outer_ - versine(l.inner_)));
  return l;
}

float SpotLight::cone(const Vec3& p) const {
  // 1 - cos is half the squared distance between two unit vectors.
  const Vec3 apart = normalize_or(p - position(), axis_) - axis_;
  const float t = std::clamp((outer_f_ - 0.5f * dot(apart, apart)) * scale_, 0.0f, 1.0f);
  return t * t;
}

Vec3 SpotLight::irradiance(const Vec3& p) const {
  return point_.irradiance(p) * cone(p);
}

double SpotLight::power() const {
  // The square rises over a width of 1/scale in cosine; the extension's minimum width clips narrow cones.
  const double scale = scale_, rise = std::min(h_outer_, 1.0 / scale);
  return 0.5 * point_.power() * (scale * scale * rise * rise * rise / 3.0 + h_outer_ - rise);
}

LightBounds SpotLight::bounds() const {
  LightBounds b = point_.bounds();
  b.axis = axis_;
  b.cos_normals = std::cos(inner_);
  b.cos_emission = std::cos(outer_ - inner_);
  return b;
}

}  // namespace kiln

// A disc of constant radiance, one- or two-sided, sampled by solid angle.
#pragma once

#include "worker/lights/light_plane.h"

namespace kiln {

class DiscLight {
 public:
  static constexpr std::string_view kType = "disc";
  static constexpr bool kDelta = false;
  // Errors, besides those of LightPlane: a radius that is not positive and finite.
  static Expected<DiscLight> parse(RecordReader& r, const Record& record, const Scene& scene);

  LightSample sample(const Vec3& p, const Vec2& u) const;
  // Distance in metres from `origin` to a shining side along the ray that left p in a unit
  // direction; negative if the side is before `origin`, infinite if the ray misses. `origin` lies
  // on that ray up to surface offsets.
  double distance(const Vec3& p, const Vec3& origin, const Vec3& direction) const;
  // Density per steradian with which sample() at p draws a unit direction; 0 if it cannot.
  float pdf(const Vec3& p, const Vec3& direction) const;
  const Vec3& radiance() const { return plane_.radiance(); }
  double power() const { return plane_.power(area()); }  // luminance
  LightBounds bounds() const { return plane_.bounds(area()); }
  BakeMode bake = BakeMode::kFull;

 private:
  double area() const { return M_PI * radius_ * radius_; }
  bool holds(const DVec2& at) const { return glm::dot(at, at) <= radius_ * radius_; }

  LightPlane plane_;
  double radius_ = 0.0;  // metres
};

}  // namespace kiln

// A disc of constant radiance, one- or two-sided, sampled by the solid angle that it subtends.
#pragma once

#include "worker/lights/light_plane.h"

namespace kiln {

class DiscLight {
 public:
  static constexpr std::string_view kType = "disc";
  static constexpr bool kDelta = false;
  // Errors, beside those of LightPlane: a radius that is not positive and finite.
  static Expected<DiscLight> parse(RecordReader& r, const Record& record, const Scene& scene);

  LightSample sample(const Vec3& p, const Vec2& u) const;
  // How far from `origin`, in metres, the ray that left p along a unit direction meets a side that shines:
  // negative before it, infinite if it never does. `origin` is on that ray, but for the offsets from
  // surfaces.
  double distance(const Vec3& p, const Vec3& origin, const Vec3& direction) const;
  // Density per steradian with which sample() at p takes a unit direction; 0 where it cannot.
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

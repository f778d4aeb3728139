// A rectangle of constant radiance, one- or two-sided, sampled by solid angle.
#pragma once

#include "worker/lights/light_plane.h"

namespace kiln {

class RectLight {
 public:
  static constexpr std::string_view kType = "rectangle";
  static constexpr bool kDelta = false;
  // Errors, besides those of LightPlane: a size that is not two positive finite numbers.
  static Expected<RectLight> parse(RecordReader& r, const Record& record, const Scene& scene);

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
  double area() const { return 4.0 * half_.x * half_.y; }
  bool holds(const DVec2& at) const { return std::abs(at.x) <= half_.x && std::abs(at.y) <= half_.y; }
  double pdf_at(const LightPlane::View& view, double solid_angle, const DVec2& at) const;

  LightPlane plane_;
  DVec2 half_{0.0};  // half the size, metres
};

}  // namespace kiln

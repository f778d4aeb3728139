// Uniform directions towards a rectangle. Urena, Fajardo & King 2013, An Area-Preserving Parametrization for
// Spherical Rectangles, section 3.
//
// Departures: the angles between the planes of the edges are differences of corner terms atan(x y / (h r)),
// so that 2 pi is never added and subtracted, and the inverse is solved in half angles, so that nothing
// cancels for a receiver close to the plane or far from the rectangle. Double precision throughout.
#pragma once

#include "common/math/trig_double.h"
#include "common/math/vec.h"

namespace kiln {

class SphericalRectangle {
 public:
  // Edges x0 < x1 and y0 < y1 at height h > 0 above the receiver, metres, relative to its foot.
  SphericalRectangle(double x0, double x1, double y0, double y1, double h)
      : x0_(x0),
        x1_(x1),
        y0_(y0),
        y1_(y1),
        h_(h),
        first_(right_of_foot(x0)),
        solid_angle_(right_of_foot(x1) - first_) {}

  // Steradians. The rounding error is below 1e-14, so a smaller angle may come out as 0 or negative.
  double solid_angle() const { return solid_angle_; }

  // A point of the plane, with direction density 1 / solid_angle(). `u` in [0, 1]^2.
  DVec2 sample(const Vec2& u) const {
    const double x = std::clamp(x_of(first_ + u.x * solid_angle_), x0_, x1_);
    return {x, std::clamp(y_of(u.y, std::sqrt(x * x + h_ * h_)), y0_, y1_)};
  }

 private:
  // Solid angle of the part of the strip [y0, y1] between the foot and x.
  double right_of_foot(double x) const {
    const auto corner = [&](double y) { return arctangent(x * y, h_ * std::sqrt(x * x + y * y + h_ * h_)); };
    return corner(y1_) - corner(y0_);
  }

  // Inverse of right_of_foot. With a = atan(y0/h), b = atan(y1/h), d = b - a, s = a + b:
  //   x = h sin(angle) / sqrt((cos angle - cos d)(cos angle + cos s)).
  double x_of(double angle) const {
    const HalfAngle a = half_of(y0_), b = half_of(y1_);
    const double sin_d = b.sin * a.cos - b.cos * a.sin, cos_d = b.cos * a.cos + b.sin * a.sin;
    const double sin_s = b.sin * a.cos + b.cos * a.sin, cos_s = b.cos * a.cos - b.sin * a.sin;
    const SinCosDouble g = sincos_radians(0.5 * angle);
    const double first = (sin_d * g.cos - cos_d * g.sin) * (sin_d * g.cos + cos_d * g.sin);
    const double second = (cos_s * g.cos - sin_s * g.sin) * (cos_s * g.cos + sin_s * g.sin);
    // Rounded past the end of an infinite strip: x is clamped later.
    return h_ * g.sin * g.cos / std::sqrt(std::max(first * second, 1e-200));
  }
  struct HalfAngle {
    double sin, cos;
  };
  HalfAngle half_of(double y) const {  // of atan(y/h)
    const double r = std::sqrt(y * y + h_ * h_), cos = std::sqrt(0.5 * (1 + h_ / r));
    return {0.5 * y / (r * cos), cos};
  }

  // At distance d from the line x = 0 at the receiver's height, directions are uniform in y /
  // sqrt(y^2 + d^2).
  double y_of(double u, double d) const {
    // Measured from the farther end, where the difference to 1 matters.
    const bool mirrored = y0_ + y1_ < 0;
    const double low = mirrored ? -y1_ : y0_, high = mirrored ? -y0_ : y1_;
    const auto below_one = [d](double y) {
      const double r2 = y * y + d * d, sine = y / std::sqrt(r2);
      return y > 0 ? d * d / (r2 * (1 + sine)) : 1 - sine;
    };
    const double first = below_one(low), e = first + (mirrored ? 1 - u : u) * (below_one(high) - first);
    const double y = (1 - e) * d / std::sqrt(e * (2 - e));
    return mirrored ? -y : y;
  }

  double x0_, x1_, y0_, y1_, h_;
  double first_, solid_angle_;
};

}  // namespace kiln

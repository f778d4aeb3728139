// Directions towards a disc, nearly uniform, with an exactly known density. A disc covers the
// inside of an elliptic cone on the sphere (Guillen et al. 2017, Area-Preserving Parameterizations
// for Spherical Ellipses, section 3.1). Uniform directions in it need elliptic integrals and their
// inverse. Instead, the angle around the axis is drawn from the ellipse that agrees with the cone's
// boundary at its four vertices in an equal-area projection, and 1 - cos of the angle from the axis
// is uniform within the boundary. The weight of a direction, 1 / density, then lies within [0.82,
// 1] of the largest, and is constant for small and for round cones.
#pragma once

#include "common/math/trig.h"
#include "common/math/vec.h"

namespace kiln {

class SphericalEllipse {
 public:
  // A disc of radius R > 0 in a plane at height h > 0 above the receiver, its centre a distance D
  // >= 0 from the receiver's foot; metres.
  SphericalEllipse(double radius, double foot, double height) : radius_(radius), foot_(foot), h_(height) {
    const double near = foot - radius, far = foot + radius;
    const double to_near = std::sqrt(near * near + height * height);
    const double to_far = std::sqrt(far * far + height * height), sum = to_near + to_far;
    // The axis bisects the angle between the nearest and the farthest point of the rim, so it divides the
    // segment between them as to_near : to_far. `beyond` is sum^2 - 4 R^2, written without cancellation.
    const double q = near * far + height * height, product = to_near * to_far;
    const double beyond = 2 * (q < 0 ? 4 * radius * radius * height * height / (product - q) : q + product);
    axis_foot_ = foot * (beyond / (sum * sum));
    shift_ = foot * (4 * radius * radius / (sum * sum));
    axis_ = std::sqrt(axis_foot_ * axis_foot_ + height * height);
    const double sin_a = 2 * radius * height / (axis_ * sum);
    const double cos_a = (axis_foot_ * far + height * height) / (axis_ * to_far);
    const double tan_b = 2 * radius * std::sqrt(product) / (axis_ * sum),
                 sec_b = std::sqrt(1 + tan_b * tan_b);
    cot2_a_ = cos_a * cos_a / (sin_a * sin_a);
    cot2_b_ = 1 / (tan_b * tan_b);
    versine_a_ = sin_a * sin_a / (1 + cos_a);
    versine_b_ = tan_b * tan_b / (sec_b * (1 + sec_b));
  }

  // In the plane, from the disc's centre: along the line from the receiver's foot to it, and across.
  struct Sample {
    DVec2 at;
    double pdf;  // per steradian
  };
  Sample sample(const Vec2& u) const {
    const SinCos turn = sincos_turns(u.y);
    const double x = std::sqrt(versine_a_) * turn.cos, y = std::sqrt(versine_b_) * turn.sin;
    const double norm2 = x * x + y * y, edge = versine_of(x * x / norm2, y * y / norm2);
    const double versine = u.x * edge, sin = std::sqrt(versine * (2 - versine) / norm2);
    const double along_axis = 1 - versine, aside = sin * x;
    // Rotate from the cone's axis into the plane's frame and project onto the plane.
    const double up = (along_axis * h_ - aside * axis_foot_) / axis_;
    const double t = h_ / std::max(up, 1e-30);
    DVec2 at(t * (along_axis * axis_foot_ + aside * h_) / axis_ - foot_, t * sin * y);
    const double beyond = length(at) / radius_;
    if (beyond > 1) at /= beyond;  // outside only by rounding
    return {at, density(x * x / norm2, y * y / norm2)};
  }
  // Density of sample() at a point of the disc.
  double pdf(const DVec2& at) const {
    const double x = h_ * (at.x + shift_) / axis_, x2 = x * x, y2 = at.y * at.y;
    return x2 + y2 > 0 ? density(x2 / (x2 + y2), y2 / (x2 + y2)) : density(1, 0);
  }

 private:
  // 1 - cos of the angle between axis and boundary, for the direction around the axis with the
  // given squared cosine and sine.
  double versine_of(double cos2, double sin2) const {
    const double cot2 = cos2 * cot2_a_ + sin2 * cot2_b_;
    return 1 / (1 + cot2 + std::sqrt(cot2 * (1 + cot2)));
  }
  double density(double cos2, double sin2) const {
    const double around = 1 / (std::sqrt(versine_a_ * versine_b_) * (cos2 / versine_a_ + sin2 / versine_b_));
    return around / (2 * M_PI * versine_of(cos2, sin2));
  }

  double radius_, foot_, h_;
  double axis_foot_, shift_,
      axis_;  // where the axis meets the plane: from the foot, from the centre; distance
  // Half angles of the cone: in the plane of symmetry (a) and across it (b).
  double cot2_a_, cot2_b_, versine_a_, versine_b_;
};

}  // namespace kiln

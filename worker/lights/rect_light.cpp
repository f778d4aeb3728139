#include "worker/lights/rect_light.h"

#include "common/base/format.h"
#include "worker/lights/spherical_rectangle.h"

namespace kiln {
namespace {

// Below this many steradians points are sampled by area: the solid angle is a difference of angles of up to
// pi/2, and its rounding error of 1e-14 would no longer be far below a float's. Both densities are exact.
// Over so small a light the area density varies little, unless the receiver is nearly in its plane.
constexpr double kLeastSolidAngle = 1e-6;

SphericalRectangle seen(const LightPlane::View& v, const DVec2& half) {
  return {-half.x - v.x, half.x - v.x, -half.y - v.y, half.y - v.y, v.height};
}

}  // namespace

Expected<RectLight> RectLight::parse(RecordReader& r, const Record& record, const Scene&) {
  const std::vector<double> size = r.numbers("size");
  const auto positive = [](double x) { return x > 0 && std::isfinite(static_cast<float>(x)); };
  if (size.size() != 2 || !positive(size[0]) || !positive(size[1]))
    return fail(ErrorKind::kInvalidInput,
                text("rectangle light '{}': its size is not two positive numbers of metres", record.name));
  RectLight l;
  l.half_ = 0.5 * DVec2(size[0], size[1]);
  KILN_TRY(l.plane_, LightPlane::parse(r, record, glm::length(l.half_)));
  l.bake = l.plane_.bake();
  return l;
}

double RectLight::pdf_at(const LightPlane::View& v, double solid_angle, const DVec2& at) const {
  if (solid_angle >= kLeastSolidAngle) return 1.0 / solid_angle;
  const DVec3 to(at.x - v.x, at.y - v.y, v.height);
  const double d2 = glm::dot(to, to);
  return d2 * std::sqrt(d2) / (v.height * area());
}

LightSample RectLight::sample(const Vec3& p, const Vec2& u) const {
  const auto view = plane_.view(p);
  if (!view) return {};
  const SphericalRectangle rectangle = seen(*view, half_);
  const double solid_angle = rectangle.solid_angle();
  const DVec2 at = solid_angle >= kLeastSolidAngle
                       ? DVec2(view->x, view->y) + rectangle.sample(u)
                       : DVec2((2.0 * u.x - 1.0) * half_.x, (2.0 * u.y - 1.0) * half_.y);
  return plane_.sample(p, *view, at, pdf_at(*view, solid_angle, at));
}

double RectLight::distance(const Vec3& p, const Vec3& origin, const Vec3& direction) const {
  const auto view = plane_.view(p);
  const auto at = view ? plane_.cross(*view, direction) : std::nullopt;
  if (!at || !holds(*at)) return std::numeric_limits<double>::infinity();
  return plane_.distance(*view, origin, direction);
}

float RectLight::pdf(const Vec3& p, const Vec3& direction) const {
  const auto view = plane_.view(p);
  const auto at = view ? plane_.cross(*view, direction) : std::nullopt;
  if (!at || !holds(*at)) return 0.0f;
  const auto density = static_cast<float>(pdf_at(*view, seen(*view, half_).solid_angle(), *at));
  return std::isfinite(density) ? density : 0.0f;
}

}  // namespace kiln

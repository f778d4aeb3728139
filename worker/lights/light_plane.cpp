#include "worker/lights/light_plane.h"

#include "common/base/format.h"
#include "worker/lights/punctual.h"

namespace kiln {
namespace {

// Tolerance for a record's unit axes: float rounding, with room for a previous rotation.
constexpr double kAxisError = 1e-5;

}  // namespace

Expected<LightPlane> LightPlane::parse(RecordReader& r, const Record& record, double reach) {
  const auto bad = [&](const std::string& what) {
    return fail(ErrorKind::kInvalidInput, text("{} light '{}': {}", record.type, record.name, what));
  };
  LightPlane l;
  const Mat4x3& m = record.to_world;
  const DVec3 x(m[0]), y(m[1]);
  const auto off = [](double value, double truth) { return !(std::abs(value - truth) <= kAxisError); };
  if (!is_finite(m[3]) || off(glm::dot(x, x), 1) || off(glm::dot(y, y), 1) || off(glm::dot(x, y), 0))
    return bad("its transform must be a rotation and translation; put scale into its size");
  l.centre_ = DVec3(m[3]);
  l.x_ = glm::normalize(x);
  const DVec3 z = glm::cross(l.x_, y);
  l.shine_ = glm::normalize(glm::dot(z, DVec3(m[2])) < 0 ? z : -z);
  l.y_ = glm::normalize(y - l.x_ * glm::dot(l.x_, y));
  l.reach_ = reach;
  // Like reach_error() of surfaces: a step of 2^-17 of the largest magnitude.
  const DVec3 far = glm::abs(l.centre_) + DVec3(reach);
  l.margin_ = 0x1p-17 * std::max({far.x, far.y, far.z});
  l.radiance_ = r.vec3("radiance", Vec3(0.0f));
  const Vec3& e = l.radiance_;
  if (!is_finite(e) || !(e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f) || !(max_component(e) > 0.0f))
    return bad(
        text("radiance {}, {}, {} is invalid; use three numbers of at least 0, not all 0", e.x, e.y, e.z));
  const float sides = r.number("sides", 1.0f);
  if (sides != 1.0f && sides != 2.0f) return bad(text("it has {} sides; there may be 1 or 2", sides));
  l.two_sided_ = sides == 2.0f;
  l.bake_ = parse_bake(r);
  return l;
}

std::optional<LightPlane::View> LightPlane::view(const Vec3& p) const {
  const DVec3 d = DVec3(p) - centre_;
  View v{glm::dot(d, x_), glm::dot(d, y_), glm::dot(d, shine_), 1.0};
  if (v.height < 0 && two_sided_) v.height = -v.height, v.side = -1.0;
  if (!(v.height > margin_)) return std::nullopt;
  return v;
}

std::optional<DVec2> LightPlane::cross(const View& view, const Vec3& direction) const {
  const DVec3 d(direction);
  const double towards = -view.side * glm::dot(d, shine_);
  if (!(towards > 0)) return std::nullopt;
  const double t = view.height / towards;
  return DVec2(view.x + t * glm::dot(d, x_), view.y + t * glm::dot(d, y_));
}

double LightPlane::distance(const View& view, const Vec3& origin, const Vec3& direction) const {
  const double height = view.side * glm::dot(DVec3(origin) - centre_, shine_);
  return (height - margin_) / (-view.side * glm::dot(DVec3(direction), shine_));
}

LightSample LightPlane::sample(const Vec3& p, const View& view, const DVec2& at, double pdf) const {
  LightSample out;
  const DVec3 to = centre_ + x_ * at.x + y_ * at.y - DVec3(p);
  out.pdf = static_cast<float>(pdf);
  if (!std::isfinite(out.pdf)) return LightSample{};
  out.direction = Vec3(glm::normalize(to));
  out.segment = Vec3(to + shine_ * (view.side * margin_));
  out.weight = radiance_ / out.pdf;
  return out;
}

double LightPlane::power(double area) const {
  return luminance(DVec3(radiance_)) * area * M_PI * (two_sided_ ? 2.0 : 1.0);
}

LightBounds LightPlane::bounds(double area) const {
  LightBounds b;
  b.centre = Vec3(centre_);
  b.radius = static_cast<float>(reach_);
  b.axis = Vec3(shine_);
  b.cos_normals = 1.0;
  b.two_sided = two_sided_;
  b.strength = luminance(DVec3(radiance_)) * area;
  return b;
}

}  // namespace kiln

#include "worker/lights/disc_light.h"

#include "common/base/format.h"
#include "worker/lights/spherical_ellipse.h"

namespace kiln {
namespace {

// The disc as seen from the receiver, and the direction in the plane from the receiver's foot to the centre.
struct Seen {
  SphericalEllipse ellipse;
  DVec2 along;

  Seen(const LightPlane::View& v, double radius) : Seen(v, radius, std::sqrt(v.x * v.x + v.y * v.y)) {}
  DVec2 to_plane(const DVec2& q) const {
    return {along.x * q.x - along.y * q.y, along.y * q.x + along.x * q.y};
  }
  DVec2 from_plane(const DVec2& q) const {
    return {along.x * q.x + along.y * q.y, along.x * q.y - along.y * q.x};
  }

 private:
  Seen(const LightPlane::View& v, double radius, double foot)
      : ellipse(radius, foot, v.height), along(foot > 0 ? DVec2(-v.x, -v.y) / foot : DVec2(1, 0)) {}
};

}  // namespace

Expected<DiscLight> DiscLight::parse(RecordReader& r, const Record& record, const Scene&) {
  const std::vector<double> radius = r.numbers("radius");
  if (radius.size() != 1 || !(radius[0] > 0) || !std::isfinite(static_cast<float>(radius[0])))
    return fail(ErrorKind::kInvalidInput,
                text("disc light '{}': its radius is not a positive number of metres", record.name));
  DiscLight l;
  l.radius_ = radius[0];
  KILN_TRY(l.plane_, LightPlane::parse(r, record, l.radius_));
  l.bake = l.plane_.bake();
  return l;
}

LightSample DiscLight::sample(const Vec3& p, const Vec2& u) const {
  const auto view = plane_.view(p);
  if (!view) return {};
  const Seen seen(*view, radius_);
  const SphericalEllipse::Sample s = seen.ellipse.sample(u);
  return plane_.sample(p, *view, seen.to_plane(s.at), s.pdf);
}

double DiscLight::distance(const Vec3& p, const Vec3& origin, const Vec3& direction) const {
  const auto view = plane_.view(p);
  const auto at = view ? plane_.cross(*view, direction) : std::nullopt;
  if (!at || !holds(*at)) return std::numeric_limits<double>::infinity();
  return plane_.distance(*view, origin, direction);
}

float DiscLight::pdf(const Vec3& p, const Vec3& direction) const {
  const auto view = plane_.view(p);
  const auto at = view ? plane_.cross(*view, direction) : std::nullopt;
  if (!at || !holds(*at)) return 0.0f;
  const Seen seen(*view, radius_);
  const auto density = static_cast<float>(seen.ellipse.pdf(seen.from_plane(*at)));
  return std::isfinite(density) ? density : 0.0f;
}

}  // namespace kiln

#include "worker/lights/ies.h"

#include "common/base/format.h"
#include "common/math/trig.h"

namespace kiln {
namespace {

constexpr float kAngleError = 2e-7f;  // error of atan2_turns and of float table angles

std::vector<float> turns(const std::vector<double>& degrees) {
  std::vector<float> out;
  for (const double d : degrees) out.push_back(static_cast<float>(d / 360.0));
  return out;
}

bool rises_within(const std::vector<float>& angles, float low, float high) {
  for (size_t i = 0; i < angles.size(); ++i)
    if (!(angles[i] >= low && angles[i] <= high) || (i && !(angles[i] > angles[i - 1]))) return false;
  return !angles.empty();
}

// The interval that contains x, and the fraction of x along it. Requires at least two angles.
struct Place {
  size_t index;
  float along;
};
Place find(const std::vector<float>& angles, float x) {
  const auto above = std::upper_bound(angles.begin() + 1, angles.end() - 1, x);
  const float low = *(above - 1), high = *above;
  return {static_cast<size_t>(above - angles.begin() - 1), std::clamp((x - low) / (high - low), 0.0f, 1.0f)};
}

}  // namespace

Expected<IesLight> IesLight::parse(RecordReader& r, const Record& record, const Scene& scene) {
  IesLight l;
  l.point_ = PointLight::parse(r, record.to_world);
  l.bake = l.point_.bake;
  l.x_ = normalize_or(record.to_world[0], Vec3(1, 0, 0));
  l.y_ = normalize_or(record.to_world[1], Vec3(0, 1, 0));
  l.z_ = normalize_or(record.to_world[2], Vec3(0, 0, 1));
  l.vertical_ = turns(r.numbers("vertical"));
  l.horizontal_ = turns(r.numbers("horizontal"));
  const TextureUse use = r.texture("candela");
  const bool angles = l.vertical_.size() >= 2 && rises_within(l.vertical_, 0.0f, 0.5f) &&
                      rises_within(l.horizontal_, 0.0f, 1.0f) &&
                      (l.horizontal_.size() == 1 || l.horizontal_.back() == l.horizontal_.front() + 1.0f);
  if (!angles || use.texture < 0)
    return fail(ErrorKind::kInvalidInput,
                text("IES light '{}': its table needs angles that rise", record.name));
  const Texture& t = scene.textures[static_cast<size_t>(use.texture)];
  if (t.format != TexelFormat::kFloat32 || t.channels != 1 || t.width != l.vertical_.size() ||
      t.height != l.horizontal_.size())
    return fail(ErrorKind::kInvalidInput,
                text("IES light '{}': its table of {} x {} does not fit its {} x {} angles", record.name,
                     t.width, t.height, l.vertical_.size(), l.horizontal_.size()));
  l.table_ = reinterpret_cast<const float*>(t.texels.data());
  for (size_t i = 0; i < size_t{t.width} * t.height; ++i)
    if (!(l.table_[i] >= 0.0f) || !std::isfinite(l.table_[i]))
      return fail(ErrorKind::kInvalidInput,
                  text("IES light '{}': candela value {} is {}", record.name, i, l.table_[i]));
  return l;
}

float IesLight::candela(const Vec3& d) const {
  const float x = dot(d, x_), y = dot(d, y_), z = dot(d, z_);
  const float theta = atan2_turns(std::sqrt(x * x + y * y), -z);
  if (theta < vertical_.front() - kAngleError || theta > vertical_.back() + kAngleError) return 0.0f;
  const Place v = find(vertical_, theta);
  const auto along = [&](size_t h) {
    return at(h, v.index) * (1.0f - v.along) + at(h, v.index + 1) * v.along;
  };
  if (horizontal_.size() == 1) return along(0);
  float phi = atan2_turns(y, x);
  if (phi < 0.0f) phi += 1.0f;
  const Place h = find(horizontal_, phi);
  return along(h.index) * (1.0f - h.along) + along(h.index + 1) * h.along;
}

Vec3 IesLight::irradiance(const Vec3& p) const {
  return point_.irradiance(p) * candela(p - position());
}

double IesLight::around(size_t v) const {
  if (horizontal_.size() == 1) return at(0, v);
  double sum = 0;
  for (size_t h = 0; h + 1 < horizontal_.size(); ++h)
    sum += 0.5 * (static_cast<double>(at(h, v)) + at(h + 1, v)) *
           (static_cast<double>(horizontal_[h + 1]) - horizontal_[h]);
  return sum;
}

// Between two vertical angles the mean is a + b theta: the integral of that times sin theta is
// -(a + b theta) cos theta + b sin theta.
double IesLight::power() const {
  double sum = 0;
  for (size_t v = 0; v + 1 < vertical_.size(); ++v) {
    const double t0 = 2 * M_PI * vertical_[v], t1 = 2 * M_PI * vertical_[v + 1];
    const double i0 = around(v), i1 = around(v + 1), slope = (i1 - i0) / (t1 - t0);
    sum += i0 * std::cos(t0) - i1 * std::cos(t1) + slope * (std::sin(t1) - std::sin(t0));
  }
  return std::max(0.0, 0.5 * point_.power() * sum);
}

LightBounds IesLight::bounds() const {
  // The range of vertical angles with light.
  size_t first = vertical_.size(), last = 0;
  for (size_t v = 0; v < vertical_.size(); ++v)
    for (size_t h = 0; h < horizontal_.size(); ++h)
      if (at(h, v) > 0.0f) first = std::min(first, v), last = std::max(last, v);
  first = first > 0 ? std::min(first, vertical_.size()) - 1 : 0;
  last = std::min(last + 1, vertical_.size() - 1);
  const double low = 2 * M_PI * vertical_[first], high = 2 * M_PI * vertical_[last];
  const bool up = M_PI - low < high;  // the narrower of the cones around nadir and zenith
  LightBounds b = point_.bounds();
  b.axis = up ? z_ : -z_;
  b.cos_normals = up ? std::cos(M_PI - low) : std::cos(high);
  b.cos_emission = 1.0;
  b.strength = power() / (2 * M_PI * std::max(1e-6, 1.0 - b.cos_normals));
  return b;
}

}  // namespace kiln

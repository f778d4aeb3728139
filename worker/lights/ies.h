// EXT_lights_ies: a point light whose intensity by direction is a measured table.
#pragma once

#include "common/base/status.h"
#include "worker/lights/punctual.h"

namespace kiln {

// Directions are those of type C photometry, with the vertical angle counted from the node's -z and the
// horizontal one from +x towards +y. Bilinear in the two angles; dark outside the vertical angles of the
// table.
class IesLight {
 public:
  static constexpr std::string_view kType = "ies";
  static constexpr bool kDelta = true;
  // Reads its candela from a texture of the scene, which outlives it. Errors: a table whose sizes or angles
  // do not fit.
  static Expected<IesLight> parse(RecordReader& r, const Record& record, const Scene& scene);
  LightSample sample(const Vec3& p, const Vec2&) const { return delta_sample(*this, p); }
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return point_.position(); }
  double power() const;  // the exact integral of the interpolant
  LightBounds bounds() const;
  BakeMode bake = BakeMode::kFull;

 private:
  float candela(const Vec3& direction) const;  // not unit
  float at(size_t h, size_t v) const { return table_[h * vertical_.size() + v]; }
  // Mean over all horizontal angles at one vertical angle of the table.
  double around(size_t v) const;

  PointLight point_;                          // whose intensity is the factor of the table
  Vec3 x_, y_, z_;                            // unit axes
  std::vector<float> vertical_, horizontal_;  // turns
  const float* table_ = nullptr;
};

}  // namespace kiln

// EXT_lights_ies: a point light whose intensity is a measured table of directions.
#pragma once

#include "common/base/status.h"
#include "worker/lights/punctual.h"

namespace kiln {

// Directions follow type C photometry: the vertical angle is counted from the node's -z, the
// horizontal one from +x towards +y. Intensity is bilinear in the two angles and 0 outside the
// table's vertical range.
class IesLight {
 public:
  static constexpr std::string_view kType = "ies";
  static constexpr bool kDelta = true;
  // Reads candela from a texture of the scene, which must outlive the light. Errors: a table whose
  // sizes or angles do not fit.
  static Expected<IesLight> parse(RecordReader& r, const Record& record, const Scene& scene);
  LightSample sample(const Vec3& p, const Vec2&) const { return delta_sample(*this, p); }
  Vec3 irradiance(const Vec3& p) const;
  const Vec3& position() const { return point_.position(); }
  double power() const;  // the exact integral of the interpolant
  LightBounds bounds() const;
  BakeMode bake = BakeMode::kFull;

 private:
  float candela(const Vec3& direction) const;  // direction need not be unit
  float at(size_t h, size_t v) const { return table_[h * vertical_.size() + v]; }
  // Mean over all horizontal angles at one vertical table angle.
  double around(size_t v) const;

  PointLight point_;                          // its intensity scales the table
  Vec3 x_, y_, z_;                            // unit axes
  std::vector<float> vertical_, horizontal_;  // turns
  const float* table_ = nullptr;
};

}  // namespace kiln

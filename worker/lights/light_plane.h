// What flat lights share: a plane with a shining side, seen from a receiver.
//
// Area lights are sheets that only emit: they neither block nor reflect rays. Paths find them as
// crossings between two surfaces (LocalLights::for_each_crossing).
#pragma once

#include <optional>

#include "common/base/status.h"
#include "common/scene/record_reader.h"
#include "worker/lights/light_bounds.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class LightPlane {
 public:
  // Reads radiance, sides and bake; the light lies in the record's xy plane and shines along its
  // -z. `reach` is the largest distance of its points from the centre in metres. Errors name the
  // light: a radiance that is negative, not finite or black; sides other than 1 and 2; a transform
  // whose x and y axes are not orthogonal unit vectors.
  static Expected<LightPlane> parse(RecordReader& r, const Record& record, double reach);

  // A receiver in the light's own frame, metres.
  struct View {
    double x, y;    // its foot in the plane, relative to the centre
    double height;  // above the side it sees, positive
    double side;    // 1: the side that shines along -z; -1: the other
  };
  // Empty where no light arrives: behind a one-sided light, or within `margin` of the plane, where
  // rounding decides on which side a point lies of the light or of the surface it is mounted on.
  std::optional<View> view(const Vec3& p) const;

  // Where a ray from the receiver along a unit direction crosses the plane, relative to the centre;
  // empty if it does not reach the side seen.
  std::optional<DVec2> cross(const View& view, const Vec3& direction) const;
  // Distance from `origin` to the sheet along that ray, up to rounding. The sheet is taken `margin`
  // closer to the receiver so that the surface it is mounted on does not hide it.
  double distance(const View& view, const Vec3& origin, const Vec3& direction) const;

  // The sample from p to the point `at` of the plane; `pdf` is per steradian. Empty if the light's
  // solid angle underflows a float.
  LightSample sample(const Vec3& p, const View& view, const DVec2& at, double pdf) const;

  const Vec3& radiance() const { return radiance_; }
  BakeMode bake() const { return bake_; }
  double power(double area) const;  // luminance of the flux of all shining sides
  LightBounds bounds(double area) const;

 private:
  DVec3 centre_{0.0}, x_{1, 0, 0}, y_{0, 1, 0}, shine_{0, 0, -1};  // shine_: unit, along -z
  double margin_ = 0.0, reach_ = 0.0;
  Vec3 radiance_{0.0f};
  bool two_sided_ = false;
  BakeMode bake_ = BakeMode::kFull;
};

}  // namespace kiln

// What flat lights share: a plane with a shining side, seen from a receiver.
//
// Lights with an area are sheets that emit and do nothing else: no ray is blocked by one, none is reflected.
// Paths find them by looking for crossings between two surfaces (LocalLights::for_each_crossing).
#pragma once

#include <optional>

#include "common/base/status.h"
#include "common/scene/record_reader.h"
#include "worker/lights/light_bounds.h"
#include "worker/lights/light_sample.h"

namespace kiln {

class LightPlane {
 public:
  // Reads radiance, sides and bake; the light lies in the record's xy plane and shines along its -z. `reach`
  // is the largest distance of its points from the centre, metres. Errors, which name the light: a radiance
  // that is negative, not finite or black; sides other than 1 and 2; a transform whose x and y axes are not
  // unit vectors at right angles.
  static Expected<LightPlane> parse(RecordReader& r, const Record& record, double reach);

  // A receiver in the light's own frame, metres.
  struct View {
    double x, y;    // of its foot in the plane, from the centre
    double height;  // above the side that it sees, positive
    double side;    // 1: it sees the side that shines along -z, -1: the other
  };
  // Nothing where no light arrives: behind a one-sided light, or so near to the plane (margin) that rounding
  // decides on which side of it, or of a surface that the light is mounted on, a point is.
  std::optional<View> view(const Vec3& p) const;

  // Where in the plane, from the centre, a ray from the receiver along a unit direction comes in on the side
  // that it sees; nothing: nowhere.
  std::optional<DVec2> cross(const View& view, const Vec3& direction) const;
  // How far from `origin`, along that ray but for rounding, the sheet is. It lies `margin` on the receiver's
  // side of the plane, so that what the light is mounted on does not hide it.
  double distance(const View& view, const Vec3& origin, const Vec3& direction) const;

  // The sample that goes from p to the point `at` of the plane; `pdf` per steradian. Empty where the light
  // subtends less than a float can say.
  LightSample sample(const Vec3& p, const View& view, const DVec2& at, double pdf) const;

  const Vec3& radiance() const { return radiance_; }
  BakeMode bake() const { return bake_; }
  double power(double area) const;  // luminance of the flux of all sides
  LightBounds bounds(double area) const;

 private:
  DVec3 centre_{0.0}, x_{1, 0, 0}, y_{0, 1, 0}, shine_{0, 0, -1};  // shine_: unit, along -z
  double margin_ = 0.0, reach_ = 0.0;
  Vec3 radiance_{0.0f};
  bool two_sided_ = false;
  BakeMode bake_ = BakeMode::kFull;
};

}  // namespace kiln

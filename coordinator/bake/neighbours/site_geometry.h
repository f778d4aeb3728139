// World-space geometry of texel sites.
#pragma once

#include <array>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/atlas/site_picker.h"

namespace kiln {

// By site: means over the texel's valid points, all of which lie on surfaces.
struct SiteGeometry {
  std::vector<Vec3> position;       // world, metres
  std::vector<Vec3> normal;         // unit, shading; 0 where the points' normals cancel
  std::vector<float> texel_size;    // metres per texel here; 0 where the face has no area in the atlas
  std::vector<uint32_t> placement;  // chart that most points lie on (the first of a tie)
  std::vector<std::array<uint32_t, 2>> texel;  // column and row on its page
  size_t size() const { return position.size(); }
};

SiteGeometry site_geometry(const Scene& scene, const Atlas& atlas, unsigned threads);

struct SitePoint {
  DVec3 position, normal;  // world; the geometric normal, 0 where the triangle has no area
};

// The valid points of one texel. The face of the last point is kept for the next one.
class PointsOnSite {
 public:
  // Both outlive the points.
  PointsOnSite(const Scene& scene, const Atlas& atlas, uint32_t site) : scene_(scene), picker_(atlas, site) {}
  uint32_t count() const { return picker_.count(); }
  SitePoint at(uint32_t index);  // below count(), in the order of SitePicker

 private:
  void enter(uint32_t instance, uint32_t triangle);

  const Scene& scene_;
  SitePicker picker_;
  // Of the triangle of the last point.
  uint32_t instance_ = 0, triangle_ = 0;
  bool entered_ = false;
  Vec3 corner_[3];
  DVec3 normal_;
};

}  // namespace kiln

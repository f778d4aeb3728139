// The baked surface of one object, with queries for the nearest point facing a given way.
#pragma once

#include <optional>

#include "common/atlas/atlas.h"
#include "common/contacts/triangle_tree.h"

namespace kiln {

// A point of a display mesh, in the world.
struct DisplayPoint {
  DVec3 at, normal, facing;  // unit: the shading normal, and the outer side of the triangle
};

struct LitPoint {
  DVec3 at, normal;
  DVec2 texels;  // on the page
  uint32_t placement = 0;
  double cost = 0;      // square metres, see SurfaceSearch
  double distance = 0;  // metres
};

// The metric of the search. Light changes more with a surface's normal than along it, so a different normal
// costs like a distance: cost = distance^2 + kTurn reach^2 |difference of the unit normals|^2.
struct SurfaceSearch {
  double reach = 0;  // metres: largest search distance
  // A difference of 60 degrees costs two reaches, so any point within reach with the right normal wins. A
  // larger weight would scatter the lookups of rough surfaces, whose normals differ between levels.
  static constexpr double kTurn = 4;
  // E is an integral over a hemisphere about the normal. At 60 degrees half of a frontal light's irradiance
  // is lost, and every point of a chamfered right-angled corner (54.7 degrees at most) still finds its faces.
  static constexpr double kMinCosine = 0.5;
};

class SourceSurface {
 public:
  static constexpr uint32_t kAnyPlacement = ~0u;

  // Scene and atlas outlive the surface.
  SourceSurface(const Scene& scene, const Atlas& atlas, const std::vector<uint32_t>& instances);

  // The point of least cost within reach whose shading normal is within 60 degrees of the display point's and
  // whose triangle faces the same side; on one chart, or on any. Ties go to the first face.
  std::optional<LitPoint> nearest(const DisplayPoint& point, const SurfaceSearch& search,
                                  uint32_t placement = kAnyPlacement) const;
  // The nearest point regardless of normal; the chart has at least one face.
  LitPoint nearest_of_any_normal(const DisplayPoint& point, uint32_t placement = kAnyPlacement) const;

  double texels_per_metre(uint32_t placement) const;  // mean of the chart
  double size() const;                                // metres, diagonal of its bounds

 private:
  struct Face {
    DVec3 corner[3], normal[3];  // world space; unit shading normals
    DVec3 facing;
    DVec2 texels[3];
    uint32_t placement = 0;
  };
  void add_instance(const Scene& scene, const Atlas& atlas, uint32_t instance);
  template <class Accept>
  std::optional<LitPoint> search(const DisplayPoint& point, double reach, double normal_weight,
                                 uint32_t placement, const Accept& accept) const;

  std::vector<Face> faces_;
  std::vector<WorldTriangle> triangles_;
  std::optional<TriangleTree> tree_;
  Box3 bounds_;
  struct Density {
    uint32_t placement;
    double square_metres, square_texels;
  };
  std::vector<Density> density_;  // by placement, sorted
};

// Barycentrics (b1, b2) of the point of triangle a, b, c nearest to p. Ericson 2004, Real-Time Collision
// Detection, 5.1.5.
DVec2 nearest_on_triangle(const DVec3& p, const DVec3& a, const DVec3& b, const DVec3& c);

}  // namespace kiln

// The seam graph: where chart borders coincide in the world and the surface continues across.
#pragma once

#include <map>
#include <span>

#include "coordinator/bake/seams/border.h"

namespace kiln {

struct SeamSettings {
  // Largest angle between the shading normals of both sides. On one surface they agree to the rounding of a
  // file's normals (0.5 degrees in 8 bits). The flattest facets that should stay visible differ by 5: a
  // cylinder of 72 sides.
  double angle_degrees = 5;
  // Largest distance of the two sides, in texels of the finer one. Float rounding and invisible gaps are
  // smaller; a real step or frame is larger at any density that resolves it.
  double tolerance_texels = 0.125;
};

// A common stretch of two border edges, first.edge < second.edge. `from` and `to` are places along each edge
// in [0, 1] and correspond: side[0].from is at side[1].from in the world.
struct SeamStretch {
  struct Side {
    uint32_t edge = 0;
    double from = 0, to = 0;
  };
  Side side[2];
  double metres = 0;
};

// A point on a seam, as read by both sides' lookups.
struct SeamPoint {
  DVec2 texel[2];
  uint32_t page[2], placement[2];
  double texels = 0;  // the length of seam it represents, in texels of the finer side
};

// Common stretches of collinear edges whose faces lie on opposite sides of them, in order. Ends need not
// coincide (T-junctions, other tessellations). Edges with more than 256 partners keep the first 256 found;
// sheets in stacks of more have them.
std::vector<SeamStretch> coincident_stretches(std::span<const BorderEdge> edges,
                                              const SeamSettings& settings);

// Points along the stretches where the shading normals agree, eight per texel of the finer side, and one for
// several stretches that are much shorter. There is no seam where both sides read the same texels (the chart
// continues), or on a line of `contacts`, where something stands on the surface and light differs on either
// side. Drops stretches without a point.
std::vector<SeamPoint> seam_points(std::span<const BorderEdge> edges, std::vector<SeamStretch>& stretches,
                                   std::span<const ContactLine> contacts, const SeamSettings& settings);

struct FoundSeams {
  std::vector<SeamStretch> stretches;
  std::vector<SeamPoint> points;
};

// The seams of an atlas, found once and cached: a bake needs them to link, fill, match and encode texels.
// `scene` and `atlas` outlive it. Not thread-safe.
class SeamFinder {
 public:
  SeamFinder(const Scene& scene, const Atlas& atlas) : scene_(scene), atlas_(atlas) {}
  SeamFinder(const SeamFinder&) = delete;
  SeamFinder& operator=(const SeamFinder&) = delete;

  const FoundSeams& find(double angle_degrees = SeamSettings{}.angle_degrees);
  const Scene& scene() const { return scene_; }
  const Atlas& atlas() const { return atlas_; }

 private:
  const Scene& scene_;
  const Atlas& atlas_;
  std::map<double, FoundSeams> found_;  // by angle
};

}  // namespace kiln

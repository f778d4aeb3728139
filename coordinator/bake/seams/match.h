// The seam graph: where borders of charts lie on each other in the world and the surface goes on across.
#pragma once

#include <map>
#include <span>

#include "coordinator/bake/seams/border.h"

namespace kiln {

struct SeamSettings {
  // Largest angle between the shading normals of both sides. Where one surface goes on they agree to the
  // rounding of a file's normals (0.5 degrees in 8 bits). The flattest facets that should show have 5: a
  // cylinder of 72.
  double angle_degrees = 5;
  // Largest distance of the two sides, in texels of the finer one. Float placement and gaps that nobody
  // sees are less; what is an object's own step or frame is more at any density that shows it.
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

// A place on a seam, as both sides' lookups see it.
struct SeamPoint {
  DVec2 texel[2];
  uint32_t page[2], placement[2];
  double texels = 0;  // the length of seam it stands for, in texels of the finer side
};

// Common stretches of collinear edges whose faces lie on opposite sides of them, in order. Ends need not
// coincide (T-junctions, other tessellations). Edges with more than 256 partners keep the first 256 found;
// sheets in stacks of more have them.
std::vector<SeamStretch> coincident_stretches(std::span<const BorderEdge> edges,
                                              const SeamSettings& settings);

// Places along the stretches, eight a texel of the finer side, and one for several of those stretches that
// are much shorter, where the shading normals agree. Where both sides read the same texels (the chart goes
// on) is no seam. Nor are places on a line of `contacts`, where something stands on the surface and light
// differs on either side of it. Stretches without a place are dropped.
std::vector<SeamPoint> seam_points(std::span<const BorderEdge> edges, std::vector<SeamStretch>& stretches,
                                   std::span<const ContactLine> contacts, const SeamSettings& settings);

struct FoundSeams {
  std::vector<SeamStretch> stretches;
  std::vector<SeamPoint> points;
};

// The seams of an atlas, looked for once and kept: a bake asks for them when texels are linked, filled,
// joined and encoded. `scene` and `atlas` outlive it. For one thread.
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

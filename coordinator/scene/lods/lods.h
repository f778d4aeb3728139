// Lightmap coordinates for meshes that were not baked: each point uses the light of the nearest baked point
// facing the same way. (O'Donnell 2018, Precomputed Global Illumination in Frostbite, projects the proxy's
// coordinates onto all levels without giving the method.)
#pragma once

#include "common/atlas/atlas.h"
#include "common/base/status.h"
#include "coordinator/scene/display/display.h"

namespace kiln {

// A share of the baked object's bounding diagonal: larger than bevels and simplification errors, smaller than
// most gaps between parts.
constexpr double kLodDistance = 0.05;

struct LodSettings {
  double distance = 0;   // metres allowed between display and baked surface; 0: kLodDistance. A set's own
                         // value takes precedence
  double split = 1;      // lookup error in texels above which a triangle is split; 0: never split
  unsigned threads = 0;  // 0: all; changes nothing but the time
};

// Triangles stay whole where one chart fits. Others are bisected along edges, equally on both sides so that
// no cracks open, down to edges of a texel; each part gets the chart that fits best. Errors (kInvalidInput)
// name every display mesh with a point that has no baked surface facing its way within the distance, or with
// lookups further off, with the position, what is there, and the way out.
Expected<Projection> project_display(const Display& display, const Scene& scene, const Atlas& atlas,
                                     const LodSettings& settings);

}  // namespace kiln

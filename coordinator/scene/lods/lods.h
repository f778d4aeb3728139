// Lightmap coordinates for meshes that were not baked: each point looks up the light of the nearest point of
// the baked surface that faces its way. (O'Donnell 2018, Precomputed Global Illumination in Frostbite,
// projects the proxy's coordinates onto all levels and does not say how.)
#pragma once

#include "common/atlas/atlas.h"
#include "common/base/status.h"
#include "coordinator/scene/display/display.h"

namespace kiln {

// A share of the baked object's bounding diagonal: bevels and simplification stay below it, other parts of an
// object seldom come that near.
constexpr double kLodDistance = 0.05;

struct LodSettings {
  double distance = 0;  // metres allowed between display and baked surface; 0: kLodDistance. A set's own goes
                        // before both
  double split = 1;     // texels a lookup may miss by before its triangle is split; 0: never split
  unsigned threads = 0;  // 0: all; changes nothing but the time
};

// Triangles stay whole where one chart serves them. Others are halved along edges, the same for both sides of
// an edge, so that no cracks open, down to edges of a texel; each part has the chart that serves it best.
// Errors (kInvalidInput) name every display mesh that has a point with no baked surface facing its way within
// the distance, or whose lookups miss by more: with the place, what is there, and what can be done.
Expected<Projection> project_display(const Display& display, const Scene& scene, const Atlas& atlas,
                                     const LodSettings& settings);

}  // namespace kiln

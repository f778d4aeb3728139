// What both sides of a seam point read from the map: bilinear lookups that should agree.
#pragma once

#include <array>

#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {

// A bilinear lookup: the sum of weight x texel. Weights are not negative and add to 1.
struct Lookup {
  std::array<uint32_t, 4> texel{};  // (page * height + y) * width + x
  std::array<float, 4> weight{};
  uint32_t count = 0;
};

struct SeamEquation {
  Lookup side[2];
  float texels = 0;  // as SeamPoint::texels
};

// Lookups of all points, in order. A texel of another chart, or one that is not set, with a weight below
// 1/128 is what a border laid on texel centres reads by rounding: it is left out. A point of which a side
// reads more of a texel that is not set or not finite has no equation.
std::vector<SeamEquation> seam_equations(const Atlas& atlas, const Lightmap& map,
                                         std::span<const SeamPoint> points);

// side 0 less side 1 in one plane. Exactly 0 where all texels read are equal.
double seam_step(const SeamEquation& equation, const std::vector<float>& plane);
// Mean of both sides.
double seam_mean(const SeamEquation& equation, const std::vector<float>& plane);

}  // namespace kiln

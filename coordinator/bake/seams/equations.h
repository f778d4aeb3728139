// The bilinear lookups on both sides of a seam point, which should agree.
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

// Lookups of all points, in order. A texel of another chart, or an unset one, with a weight below 1/128 is
// read only through rounding of a border on texel centres, and is dropped. A point where a side reads more of
// an unset or non-finite texel has no equation.
std::vector<SeamEquation> seam_equations(const Atlas& atlas, const Lightmap& map,
                                         std::span<const SeamPoint> points);

// side 0 minus side 1 in one plane. Exactly 0 where all texels read are equal.
double seam_step(const SeamEquation& equation, const std::vector<float>& plane);
// Mean of both sides.
double seam_mean(const SeamEquation& equation, const std::vector<float>& plane);

}  // namespace kiln

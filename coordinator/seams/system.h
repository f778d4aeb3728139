// The least-squares problem of the seams, without its numbers per plane.
#pragma once

#include "coordinator/seams/equations.h"
#include "coordinator/seams/solve.h"

namespace kiln {

// Energy of corrections c, all weights relative to one unit of "slope":
//   seam   x sum over seam points   texels x (step of c + step of the map)^2
//   slope  x sum over neighbours    (c_i - c_j)^2        c is 0 on texels beyond `reach`
//   value  x sum over texels        trust_i c_i^2
struct SeamWeights {
  double seam = 4096;   // steps that stay are about sqrt(1/seam) of what they were where sides can agree
  double slope = 1;     // spreads a correction over sqrt(slope / value) texels
  double value = 0.25;  // two texels
  uint32_t reach = 6;   // texels from the seam; further ones do not move
  bool by_error = true;  // trust_i from the stated error; else 1
};

// The texels that may move, ascending, and the equations between them by index into that list.
struct SeamUnknowns {
  std::vector<uint32_t> texels;
  LeastSquares problem;
};
SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           const SeamWeights& weights);

}  // namespace kiln

// The seams' least-squares problem, without the values of each plane.
#pragma once

#include "coordinator/bake/seams/doubt.h"
#include "coordinator/bake/seams/solve.h"

namespace kiln {

// The corrections c minimise
//   seam   x sum over seam points   g_p x texels x (step of c + what is to be closed of the step)^2
//   slope  x sum over neighbours    (c_i - c_j)^2              c is 0 on texels beyond `reach`
//   value  x sum over texels        c_i^2                      of filled texels 1/64 of that
// All measured texels have equal weight, whatever their value and error: a step is closed from both sides,
// and the corrections sum to zero. Weights by value, or by the correlated error, would move the brighter side
// further than the darker. doubt.h separates noise from light.
struct SeamWeights {
  double seam = 256;
  double slope = 0.25;  // spreads a correction over sqrt(slope / value) texels:
  double value = 1;     // one
  uint32_t reach = 2;   // texels from the seam; further ones do not change
  DoubtSettings doubt = {};
  // Largest correction, in units of the texel's noise: equations that together ask for more are where light
  // varies within a texel, and are dropped round by round.
  double most = 1.5;
  uint32_t rounds = 3;
};

// The texels that may change, ascending, and the equations between them by index into that list.
struct SeamUnknowns {
  std::vector<uint32_t> texels;
  std::vector<double> noise;  // by texel: squared noise of the points that read it; 0: none
  LeastSquares problem;
};
SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           std::span<const SeamDoubt> doubts, const SeamWeights& weights);

// Lowers the weights of equations that require corrections of E beyond `most`.
void leave_out(const Lightmap& map, std::span<const SeamEquation> equations,
               std::span<const SeamDoubt> doubts, const SeamWeights& weights, SeamUnknowns& unknowns);

}  // namespace kiln

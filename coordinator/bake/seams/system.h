// The least-squares problem of the seams, without its numbers per plane.
#pragma once

#include "coordinator/bake/seams/doubt.h"
#include "coordinator/bake/seams/solve.h"

namespace kiln {

// What the corrections c make least:
//   seam   x sum over seam points   g_p x texels x (step of c + what is to be closed of the step)^2
//   slope  x sum over neighbours    (c_i - c_j)^2              c is 0 on texels beyond `reach`
//   value  x sum over texels        c_i^2                      of filled texels 1/64 of that
// All measured texels count alike, whatever they hold and state: a step is closed from both sides, and the
// corrections add up to nothing. Weights by what texels hold, or by what is stated of them, which goes with
// it, would move the brighter side further than the darker. What is noise and what is light decides doubt.h.
struct SeamWeights {
  double seam = 256;
  double slope = 0.25;  // spreads a correction over sqrt(slope / value) texels:
  double value = 1;     // one
  uint32_t reach = 2;   // texels from the seam; further ones do not move
  DoubtSettings doubt = {};
  // Of corrections, in the noise of the texel: equations that ask for more together are of a place where
  // light changes within a texel. They are left out, round by round.
  double most = 1.5;
  uint32_t rounds = 3;
};

// The texels that may move, ascending, and the equations between them by index into that list.
struct SeamUnknowns {
  std::vector<uint32_t> texels;
  std::vector<double> noise;  // by texel: squared, of the points that read it; 0: none does
  LeastSquares problem;
};
SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           std::span<const SeamDoubt> doubts, const SeamWeights& weights);

// Lowers the weights of equations that ask for corrections of E beyond `most`.
void leave_out(const Lightmap& map, std::span<const SeamEquation> equations,
               std::span<const SeamDoubt> doubts, const SeamWeights& weights, SeamUnknowns& unknowns);

}  // namespace kiln

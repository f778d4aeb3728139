// The least-squares problem of the seams, without its numbers per plane.
#pragma once

#include "coordinator/seams/equations.h"
#include "coordinator/seams/solve.h"

namespace kiln {

// What the corrections c make least:
//   seam   x sum over seam points   texels x (step of c + step of the map)^2 / s_p^2
//   slope  x sum over neighbours    (c_i - c_j)^2 / s_ij^2    c is 0 on texels beyond `reach`
//   value  x sum over texels        (c_i / s_i)^2               of filled texels 1/64 of that
// s_i = light x sqrt(stated relative variance around the texel + model^2), where the light is that of both
// sides; s_p^2 and s_ij^2 are means of s_i^2. So the side that is known better gives way less, and light at a
// seam in the dark is not made from what is wrong beside it in the sun. The variance is relative and a mean
// over 5 x 5 texels: a texel's own follows its value, and would prefer the darker side.
struct SeamWeights {
  double seam = 256;
  double slope = 0.25;  // spreads a correction over sqrt(slope / value) texels:
  double value = 1;     // one
  uint32_t reach = 2;   // texels from the seam; further ones do not move
  double model = 0.01;
  // Limits (limits.h).
  double errors = 2;     // stated errors that a texel may move whatever the other side says
  double share = 0.75;   // of what the other side differs by that it may move towards it
  uint32_t rounds = 24;  // of the solve within limits
};

// The texels that may move, ascending, with what is known around each, and the equations between them by
// index into that list.
struct SeamUnknowns {
  std::vector<uint32_t> texels;
  // Luminance of E: harmonic mean of both sides' lookups where seams read the texel (beside light the dark
  // counts, on both sides alike), else its own; kDarkStep of the map's mean at least.
  std::vector<double> light;
  std::vector<double> variance;    // stated around the texel, relative to the square of the light there
  std::vector<double> own, error;  // luminance of E of the texel itself, and what is stated of it
  LeastSquares problem;
};
SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           const SeamWeights& weights);

}  // namespace kiln

// The least-squares problem of the seams, without its numbers per plane.
#pragma once

#include "coordinator/seams/equations.h"
#include "coordinator/seams/solve.h"

namespace kiln {

// What the corrections c make least:
//   seam   x sum over seam points   texels x (step of c + step of the map)^2
//   slope  x sum over neighbours    (c_i - c_j)^2        c is 0 on texels beyond `reach`
//   value  x sum over texels        trust_i c_i^2          trust 1, of filled texels 1/64
// Equal trust, whatever the stated errors: the corrections of a part of the map that lies within reach of its
// seams then add to 0, so light is moved and never made, and a weight that depends on the value by its stated
// error cannot prefer the darker side. Filled texels are guesses from their neighbours.
struct SeamWeights {
  double seam = 4096;
  double slope = 1;    // spreads a correction over sqrt(slope / value) texels:
  double value = 1;    // one
  uint32_t reach = 6;  // texels from the seam; further ones do not move
  // Equations that still differ by more than this share of their local mean are weighted up and solved again,
  // up to `rounds` times. Where texels of both sides are staggered, lines that agree everywhere are straight:
  // a high weight everywhere would flatten what the light does along a seam for the sake of 0.01 %.
  double most_step = 0.0025;
  uint32_t rounds = 12;
  // The rounds end once texels have moved by this many times what the first solve moved them: agreement that
  // takes more flattens the light.
  double most_change = 1.25;
};

// The texels that may move, ascending, and the equations between them by index into that list.
struct SeamUnknowns {
  std::vector<uint32_t> texels;
  LeastSquares problem;
};
SeamUnknowns seam_unknowns(const Atlas& atlas, const Lightmap& map, std::span<const SeamEquation> equations,
                           const SeamWeights& weights);

}  // namespace kiln

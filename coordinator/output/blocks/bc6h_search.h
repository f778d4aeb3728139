// Search for the block with the least decoded error. Every candidate is judged by what a decoder makes of its
// quantised end points.
#pragma once

#include "coordinator/output/blocks/bc6h_fit.h"
#include "coordinator/output/blocks/bc6h_levels.h"

namespace kiln::bc6h {

// The block as the search has it: indices as they fell, anchors not settled.
struct Candidate {
  Block block;
  Cost cost;            // of both regions
  float score = 3e38f;  // error and worst texel together; less is better
};

// Finds indices and cost. False: the differences between end points find no room with these anchors.
bool judge(const Target& target, Candidate& candidate);

// Texels on lines, one a region, in the finest mode that has room. Indices and cost found.
Candidate one_region(const Target& target, const Line& line);
Candidate two_region(const Target& target, int partition, const Line (&lines)[2]);

// Solves for the end points while that gains, `rounds` times at most.
void solve(const Target& target, int rounds, Candidate& candidate);

// Solves again from end points shifted along their line, each by up to `reach` half levels out- and inwards:
// texels then fall to other levels, which no solving by itself leads to.
void stretch(const Target& target, int reach, int solves, Candidate& candidate);

// Tries lines so long that a few neighbouring levels cover the block's range: end points are then many, and
// some are right to a fraction of a cell. For blocks of little range; one region.
void fold(const Target& target, Candidate& candidate);

// Moves end points by single steps, channel by channel and both ends of a channel together, while that gains,
// `rounds` times at most.
void descend(const Target& target, int rounds, Candidate& candidate);

}  // namespace kiln::bc6h

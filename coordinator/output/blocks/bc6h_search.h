// Searches for the block of least decoded error. Every candidate is decoded from its quantised end points.
#pragma once

#include "coordinator/output/blocks/bc6h_fit.h"
#include "coordinator/output/blocks/bc6h_levels.h"

namespace kiln::bc6h {

// The block during the search: indices as assigned, anchors not settled.
struct Candidate {
  Block block;
  Cost cost;            // of both regions
  float score = 3e38f;  // error and worst texel combined; lower is better
};

// Finds indices and cost. False: the differences between end points do not fit with these anchors.
bool judge(const Target& target, Candidate& candidate);

// Quantises lines, one per region, in the finest mode that fits, and finds indices and cost.
Candidate one_region(const Target& target, const Line& line);
Candidate two_region(const Target& target, int partition, const Line (&lines)[2]);

// Solves for the end points while the score improves, `rounds` times at most.
void solve(const Target& target, int rounds, Candidate& candidate);

// Solves again from end points shifted along their line, each by up to `reach` half levels out- and inwards:
// texels then move to other levels, which solving alone cannot reach.
void stretch(const Target& target, int reach, int solves, Candidate& candidate);

// Tries lines so long that a few neighbouring levels cover the block's range: many such end points exist, and
// some match to a fraction of a quantisation cell. For blocks of small range; one region.
void fold(const Target& target, Candidate& candidate);

// Moves end points by single steps, per channel and both ends of a channel together, while the score
// improves, `rounds` times at most.
void descend(const Target& target, int rounds, Candidate& candidate);

}  // namespace kiln::bc6h

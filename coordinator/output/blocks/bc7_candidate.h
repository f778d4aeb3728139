// A BC7 block before it is packed.
#pragma once

#include <cstdint>

namespace kiln {

struct Bc7Candidate {
  float error = 0;
  uint8_t mode = 0, partition = 0, rotation = 0, selector = 0;
  uint8_t ends[3][2][4] = {};  // by subset, end, channel (after rotation); without p
  uint8_t p[3][2] = {};
  uint8_t index[16] = {}, index2[16] = {};  // of colours, of alpha; index2 of modes 4 and 5 alone
};

// Swaps end points where an anchor's index has its highest bit set.
void pack_bc7(Bc7Candidate candidate, uint8_t* block);

}  // namespace kiln

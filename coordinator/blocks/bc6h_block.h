// A BC6H block taken apart, and its 128 bits.
#pragma once

#include <cstdint>

#include "coordinator/blocks/bc6h_modes.h"

namespace kiln::bc6h {

struct Block {
  int mode = 0;         // -1: reserved
  int partition = 0;    // of modes with two regions
  int ends[4][3] = {};  // end points by channel: both of region 0, both of region 1; differences undone
  uint8_t index[16] = {};
};

// Whether the differences between the block's end points have room in its mode.
bool fits(const Block& block, bool is_signed);

// Exchanges end points so that the anchors' indices lose their upper bits; fits() may be another after it.
void settle_anchors(Block& block);

// Writes 16 bytes. The block fits and its anchors are settled.
void pack(const Block& block, uint8_t* bytes);

Block unpack(const uint8_t* bytes, bool is_signed);

}  // namespace kiln::bc6h

// The fields of a BC6H block, and its 128 bits.
#pragma once

#include <cstdint>

#include "coordinator/output/blocks/bc6h_modes.h"

namespace kiln::bc6h {

struct Block {
  int mode = 0;         // -1: reserved
  int partition = 0;    // of modes with two regions
  int ends[4][3] = {};  // end points by channel: both of region 0, both of region 1; differences undone
  uint8_t index[16] = {};
};

// Whether the differences of the end points to one of them (0 or 1) fit the block's mode.
bool fits(const Block& block, int base, bool is_signed);

// The end point of region 0 that settle_anchors() puts first.
int settled_base(const Block& block);

// Swaps end points so that the anchors' indices have upper bit 0.
void settle_anchors(Block& block);

// Writes 16 bytes. The block must fit and its anchors be settled.
void pack(const Block& block, uint8_t* bytes);

Block unpack(const uint8_t* bytes, bool is_signed);

}  // namespace kiln::bc6h

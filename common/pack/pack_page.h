// One page of bits while it is being filled.
#pragma once

#include "common/pack/mask_set.h"

namespace kiln {

// A mask in one orientation, prepared for the search.
class PackShape {
 public:
  PackShape(const MaskView& mask, bool turned);

  struct Probe {
    uint32_t x, y;
  };
  MaskView mask;
  bool turned;
  std::vector<Probe> probes;  // some set bits, far apart first
  bool complete = false;      // probes cover all its bits
  // The longest row of set bits in each of the mask's rows, longest first.
  struct Run {
    uint32_t length, y;
  };
  std::vector<Run> runs;
};

class PackPage {
 public:
  PackPage(uint32_t width, uint32_t max_height) : bits_(width, 0), max_height_(max_height) {}

  uint32_t used_height() const { return used_height_; }
  uint32_t used_width() const { return used_width_; }
  uint64_t used_bits() const { return used_bits_; }
  uint64_t work() const { return work_; }  // tests of 64 positions so far

  struct Place {
    uint32_t x, y;
    size_t shape;
  };
  // The first position in row order, from row `y` on and with the whole mask above row `limit`, where one of
  // the shapes fits; within a row the lowest x, then the first shape.
  bool find(std::span<const PackShape> shapes, uint32_t y, uint32_t limit, Place& place);
  // Sets the mask's bits. The mask must lie within the page's width and maximum height.
  bool is_free(const MaskView& mask, uint32_t x, uint32_t y) const;
  void insert(const MaskView& mask, uint32_t x, uint32_t y);

 private:
  void grow(uint32_t height);
  bool has_room(const PackShape& shape, uint32_t y) const;
  bool find_in_row(const PackShape& shape, uint32_t y, uint32_t& x);

  BitImage bits_;
  std::vector<uint32_t> free_run_;  // by row: the longest run of free bits
  uint32_t max_height_, used_width_ = 0, used_height_ = 0;
  uint64_t used_bits_ = 0, work_ = 0;
};

}  // namespace kiln

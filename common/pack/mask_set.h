// Chart masks stored back to back in one array: a level has hundreds of thousands, most of a few words.
#pragma once

#include <span>

#include "common/raster/bit_image.h"

namespace kiln {

// Rows of (width + 63) / 64 words each; bits beyond the width are zero.
struct MaskView {
  uint32_t width = 0, height = 0;
  const uint64_t* words = nullptr;

  uint32_t words_per_row() const { return (width + 63) / 64; }
  const uint64_t* row(uint32_t y) const { return words + size_t{words_per_row()} * y; }
  bool get(uint32_t x, uint32_t y) const { return row(y)[x / 64] >> (x % 64) & 1; }
  uint64_t count() const;
};

// Calls visit(x, y) for each set bit, row by row.
template <class Visit>
void for_each_bit(const MaskView& mask, const Visit& visit) {
  for (uint32_t y = 0; y < mask.height; ++y)
    for (uint32_t w = 0; w < mask.words_per_row(); ++w)
      for (uint64_t bits = mask.row(y)[w]; bits; bits &= bits - 1)
        visit(64 * w + static_cast<uint32_t>(std::countr_zero(bits)), y);
}

// Where bit (x, y) of a mask lies when it is turned by 90 degrees: the turned mask is `height` wide and
// `width` high.
inline uint32_t turned_x(uint32_t height, uint32_t y) {
  return height - 1 - y;
}

class MaskSet {
 public:
  uint32_t size() const { return static_cast<uint32_t>(places_.size()); }
  MaskView operator[](uint32_t i) const {
    return {places_[i].width, places_[i].height, words_.data() + places_[i].first};
  }

  void add(const BitImage& mask);
  // A view passed to these must not point into this set.
  void add(const MaskView& mask);
  void add_turned(const MaskView& mask);
  // Every cell of `cell` x `cell` bits, counted from the mask's first, that holds a bit becomes one bit.
  void add_reduced(const MaskView& mask, uint32_t cell);
  void append(const MaskSet& other);
  void clear();
  void reserve(size_t masks, size_t words);
  size_t word_count() const { return words_.size(); }

 private:
  struct Place {
    size_t first;
    uint32_t width, height;
  };
  uint64_t* add_empty(uint32_t width, uint32_t height);

  std::vector<Place> places_;
  std::vector<uint64_t> words_;
};

}  // namespace kiln

#include "common/pack/mask_set.h"

#include <algorithm>

namespace kiln {

uint64_t MaskView::count() const {
  uint64_t n = 0;
  for (size_t w = 0; w < size_t{words_per_row()} * height; ++w)
    n += static_cast<uint64_t>(std::popcount(words[w]));
  return n;
}

uint64_t* MaskSet::add_empty(uint32_t width, uint32_t height) {
  const size_t first = words_.size();
  places_.push_back({first, width, height});
  words_.resize(first + size_t{(width + 63) / 64} * height);
  return words_.data() + first;
}

void MaskSet::add(const BitImage& mask) {
  const uint32_t per_row = mask.words_per_row();
  uint64_t* to = add_empty(mask.width(), mask.height());
  for (uint32_t y = 0; y < mask.height(); ++y) std::copy_n(mask.row(y), per_row, to + size_t{per_row} * y);
}

void MaskSet::add(const MaskView& mask) {
  uint64_t* to = add_empty(mask.width, mask.height);
  std::copy_n(mask.words, size_t{mask.words_per_row()} * mask.height, to);
}

void MaskSet::add_turned(const MaskView& mask) {
  uint64_t* to = add_empty(mask.height, mask.width);
  const size_t per_row = (mask.height + 63) / 64;
  for_each_bit(mask, [&](uint32_t x, uint32_t y) {
    const uint32_t tx = turned_x(mask.height, y);
    to[per_row * x + tx / 64] |= uint64_t{1} << (tx % 64);
  });
}

void MaskSet::add_reduced(const MaskView& mask, uint32_t cell) {
  const uint32_t width = (mask.width + cell - 1) / cell, height = (mask.height + cell - 1) / cell;
  uint64_t* to = add_empty(width, height);
  const size_t per_row = (width + 63) / 64;
  for_each_bit(mask, [&](uint32_t x, uint32_t y) {
    to[per_row * (y / cell) + x / cell / 64] |= uint64_t{1} << (x / cell % 64);
  });
}

void MaskSet::append(const MaskSet& other) {
  const size_t first = words_.size();
  for (Place place : other.places_) {
    place.first += first;
    places_.push_back(place);
  }
  words_.insert(words_.end(), other.words_.begin(), other.words_.end());
}

void MaskSet::clear() {
  places_.clear();
  words_.clear();
}

void MaskSet::reserve(size_t masks, size_t words) {
  places_.reserve(masks);
  words_.reserve(words);
}

}  // namespace kiln

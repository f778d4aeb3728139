// One bit a texel in 64-bit words. Each row has one zero word more than its bits need, so an unaligned
// read needs no test of bounds. (Roughton 2019, listing 4.1; the shift by 64 for aligned reads is guarded.)
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace kiln {

class BitImage {
 public:
  BitImage() = default;
  BitImage(uint32_t width, uint32_t height)
      : width_(width), height_(height), stride_(width / 64 + 2), words_(size_t{stride_} * height) {}

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  uint32_t words_per_row() const { return (width_ + 63) / 64; }
  const uint64_t* row(uint32_t y) const { return words_.data() + size_t{stride_} * y; }
  uint64_t* row(uint32_t y) { return words_.data() + size_t{stride_} * y; }
  bool get(uint32_t x, uint32_t y) const { return row(y)[x / 64] >> (x % 64) & 1; }

  // Rows are only ever added.
  void grow(uint32_t height) {
    if (height <= height_) return;
    height_ = height;
    words_.resize(size_t{stride_} * height);
  }
  // Sets bits x0 .. x1 of row y.
  void set_span(uint32_t y, uint32_t x0, uint32_t x1) {
    uint64_t* r = row(y);
    const uint64_t head = ~uint64_t{0} << (x0 % 64), tail = ~uint64_t{0} >> (63 - x1 % 64);
    if (x0 / 64 == x1 / 64) {
      r[x0 / 64] |= head & tail;
      return;
    }
    r[x0 / 64] |= head;
    for (uint32_t w = x0 / 64 + 1; w < x1 / 64; ++w) r[w] = ~uint64_t{0};
    r[x1 / 64] |= tail;
  }
  uint64_t count() const {
    uint64_t n = 0;
    for (uint64_t w : words_) n += static_cast<uint64_t>(std::popcount(w));
    return n;
  }

 private:
  uint32_t width_ = 0, height_ = 0, stride_ = 0;
  std::vector<uint64_t> words_;
};

// 64 bits of a row from bit x on; the row ends at least one word after x.
inline uint64_t bits_from(const uint64_t* row, uint32_t x) {
  const uint32_t w = x / 64, shift = x % 64;
  return shift ? row[w] >> shift | row[w + 1] << (64 - shift) : row[w];
}

}  // namespace kiln

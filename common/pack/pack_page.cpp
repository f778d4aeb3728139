#include "common/pack/pack_page.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {
namespace {

// Longest run of ones in `words`.
uint32_t longest_run(const uint64_t* words, uint32_t count, bool inverted, uint32_t width) {
  uint32_t longest = 0, open = 0;  // open: the run that extends to the end of the words so far
  for (uint32_t w = 0; w < count; ++w) {
    uint64_t bits = inverted ? ~words[w] : words[w];
    if (w + 1 == count && width % 64) bits &= (uint64_t{1} << (width % 64)) - 1;
    if (bits == ~uint64_t{0}) {
      open += 64;
      continue;
    }
    longest = std::max(longest, open + static_cast<uint32_t>(std::countr_one(bits)));
    open = static_cast<uint32_t>(std::countl_one(bits));
    uint32_t inside = 0;
    for (; bits; bits &= bits << 1) ++inside;
    longest = std::max(longest, inside);
  }
  return std::max(longest, open);
}

}  // namespace

PackShape::PackShape(const MaskView& m, bool is_turned) : mask(m), turned(is_turned) {
  constexpr size_t kMax = 40;
  std::vector<Probe> bits;
  for_each_bit(mask, [&](uint32_t x, uint32_t y) { bits.push_back({x, y}); });
  for (uint32_t y = 0; y < mask.height; ++y)
    runs.push_back({longest_run(mask.row(y), mask.words_per_row(), false, mask.width), y});
  std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) {
    return a.length != b.length ? a.length > b.length : a.y < b.y;
  });
  complete = bits.size() <= kMax;
  const size_t count = std::min(bits.size(), kMax);
  // Multiples of the golden ratio spread over the list, however many probes run before one fails.
  constexpr uint32_t kGolden = 2654435769u;
  for (uint32_t k = 0, turn = 0; k < count; ++k, turn += kGolden) {
    size_t i = bits.size() * turn >> 32;
    while (bits[i].y == ~0u) i = (i + 1) % bits.size();
    probes.push_back(bits[i]);
    bits[i].y = ~0u;
  }
}

bool PackPage::find(std::span<const PackShape> shapes, uint32_t y, uint32_t limit, Place& place) {
  limit = std::min(limit, max_height_);
  uint32_t last = 0;  // row at which some shape may start
  bool any = false;
  for (const PackShape& shape : shapes) {
    if (shape.mask.height > limit || shape.mask.width > bits_.width()) continue;
    any = true;
    const uint32_t begin = std::min(used_height_, limit - shape.mask.height);
    grow(begin + shape.mask.height);
    last = std::max(last, begin);
  }
  if (!any) return false;
  for (; y <= last; ++y) {
    bool found = false;
    for (size_t s = 0; s < shapes.size(); ++s) {
      const PackShape& shape = shapes[s];
      if (y + shape.mask.height > limit || shape.mask.width > bits_.width()) continue;
      uint32_t x;
      if (!has_room(shape, y) || !find_in_row(shape, y, x) || (found && x >= place.x)) continue;
      place = {x, y, s};
      found = true;
    }
    if (found) return true;
  }
  return false;
}

void PackPage::insert(const MaskView& mask, uint32_t x, uint32_t y) {
  KILN_CHECK(x + mask.width <= bits_.width() && y + mask.height <= max_height_);
  grow(y + mask.height);
  const uint32_t shift = x % 64;
  for (uint32_t r = 0; r < mask.height; ++r) {
    uint64_t* to = bits_.row(y + r) + x / 64;
    for (uint32_t w = 0; w < mask.words_per_row(); ++w) {
      const uint64_t word = mask.row(r)[w];
      to[w] |= word << shift;
      if (shift) to[w + 1] |= word >> (64 - shift);
      used_bits_ += static_cast<uint32_t>(std::popcount(word));
    }
    free_run_[y + r] = longest_run(bits_.row(y + r), bits_.words_per_row(), true, bits_.width());
  }
  used_width_ = std::max(used_width_, x + mask.width);
  used_height_ = std::max(used_height_, y + mask.height);
}

void PackPage::grow(uint32_t height) {
  bits_.grow(height);
  free_run_.resize(bits_.height(), bits_.width());
}

bool PackPage::has_room(const PackShape& shape, uint32_t y) const {
  for (const PackShape::Run& run : shape.runs)
    if (free_run_[y + run.y] < run.length) return false;
  return true;
}

bool PackPage::find_in_row(const PackShape& shape, uint32_t y, uint32_t& x) {
  const uint32_t positions = bits_.width() - shape.mask.width + 1;
  for (uint32_t block = 0; block < positions; block += 64) {
    ++work_;
    uint64_t open = positions - block >= 64 ? ~uint64_t{0} : (uint64_t{1} << (positions - block)) - 1;
    for (const PackShape::Probe& p : shape.probes) {
      open &= ~bits_from(bits_.row(y + p.y), block + p.x);
      if (!open) break;
    }
    for (; open; open &= open - 1) {
      x = block + static_cast<uint32_t>(std::countr_zero(open));
      if (shape.complete || is_free(shape.mask, x, y)) return true;
    }
  }
  return false;
}

bool PackPage::is_free(const MaskView& mask, uint32_t x, uint32_t y) const {
  const uint32_t rows =
      std::min(mask.height, bits_.height() > y ? bits_.height() - y : 0);  // the rest is free
  for (uint32_t r = 0; r < rows; ++r) {
    const uint64_t* page = bits_.row(y + r);
    const uint64_t* row = mask.row(r);
    for (uint32_t w = 0; w < mask.words_per_row(); ++w)
      if (row[w] && bits_from(page, x + 64 * w) & row[w]) return false;
  }
  return true;
}

}  // namespace kiln

#include "tests/bench/plain_sweep.h"

#include <algorithm>
#include <numeric>

namespace kiln::bench {
namespace {

bool free_at(const BitImage& page, const MaskView& mask, uint32_t x, uint32_t y) {
  for (uint32_t r = 0; r < mask.height; ++r)
    for (uint32_t w = 0; w < mask.words_per_row(); ++w)
      if (bits_from(page.row(y + r), x + 64 * w) & mask.row(r)[w]) return false;
  return true;
}

void insert(BitImage& page, const MaskView& mask, uint32_t x, uint32_t y) {
  for_each_bit(mask, [&](uint32_t bx, uint32_t by) { page.set_span(y + by, x + bx, x + bx); });
}

}  // namespace

PackResult plain_sweep(const MaskSet& masks, uint32_t width) {
  std::vector<uint32_t> order(masks.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return masks[a].width + masks[a].height > masks[b].width + masks[b].height;
  });
  PackResult r;
  r.places.resize(masks.size());
  r.width = width;
  r.pages = 1;
  BitImage page(width + 64, 0);  // a look at a row's end stays within it
  for (uint32_t i : order) {
    const MaskView mask = masks[i];
    page.grow(r.height + mask.height);
    bool placed = false;
    for (uint32_t y = 0; !placed; ++y)
      for (uint32_t x = 0; x + mask.width <= width && !placed; ++x) {
        if (!free_at(page, mask, x, y)) continue;
        insert(page, mask, x, y);
        r.places[i] = {x, y, 0};
        r.height = std::max(r.height, y + mask.height);
        placed = true;
      }
  }
  r.height = (r.height + 3) / 4 * 4;
  return r;
}

}  // namespace kiln::bench

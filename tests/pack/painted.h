// A packing checked bit by bit.
#pragma once

#include <gtest/gtest.h>

#include <numeric>

#include "common/pack/pack.h"
#include "tests/atlas/shapes.h"
#include "tests/pack/level.h"

namespace kiln::test {

// One item for each mask.
inline PackResult pack_all(const MaskSet& masks, const PackSettings& settings,
                           const PreviousPlaces* previous = nullptr) {
  std::vector<uint32_t> items(masks.size());
  std::iota(items.begin(), items.end(), 0u);
  return pack_masks(masks, items, settings, previous);
}

// Places in texels, bits of `cell` texels a side.
struct Painted {
  uint64_t bits = 0, expected = 0, shared = 0, outside = 0;
  std::vector<uint64_t> by_page;
  uint64_t all = 0;

  Painted(const MaskSet& masks, const PackResult& r, uint32_t cell = 1) : by_page(r.pages) {
    const uint32_t width = r.width / cell, height = r.height / cell;
    all = uint64_t{width} * height * r.pages;
    std::vector<uint8_t> taken(all);
    for (uint32_t i = 0; i < masks.size(); ++i) {
      const MaskView mask = masks[i];
      const PackPlace& place = r.places[i];
      expected += mask.count();
      for_each_bit(mask, [&](uint32_t bx, uint32_t by) {
        const uint64_t x = place.x / cell + uint64_t{place.turned ? mask.height - 1 - by : bx};
        const uint64_t y = place.y / cell + uint64_t{place.turned ? bx : by};
        if (x >= width || y >= height || place.page >= r.pages) {
          ++outside;
          return;
        }
        shared += taken[(place.page * uint64_t{height} + y) * width + x]++;
        ++bits;
        ++by_page[place.page];
      });
    }
  }
  double share() const { return static_cast<double>(bits) / static_cast<double>(all); }
};

}  // namespace kiln::test

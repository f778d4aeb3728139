// Places chart masks on pages so that none share a texel.
#pragma once

#include <span>

#include "common/raster/bit_image.h"

namespace kiln {

struct PackSettings {
  uint32_t max_page_size = 8192;
  uint32_t max_pages = 64;
  // Sizes are rounded up to this: block compressed textures have 4x4 blocks.
  uint32_t size_multiple = 4;
};

struct PackPlace {
  uint32_t x, y, page;
};

struct PackResult {
  std::vector<PackPlace> places;  // by item
  uint32_t width = 0, height = 0, pages = 0;
  bool fits = true;  // false: more than max_pages were needed, the rest is meaningless
};

// `items` are masks, each not larger than a page; the same mask may occur many times. The result depends
// on nothing but the arguments.
PackResult pack_masks(std::span<const BitImage* const> items, const PackSettings& settings);

}  // namespace kiln

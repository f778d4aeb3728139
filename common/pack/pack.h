// Places chart masks on pages so that none share a texel.
//
// O'Donnell 2018, "Precomputed Global Illumination in Frostbite", atlas packing, and Roughton 2019, 4.1.3:
// largest first, row sweep on bit masks, start from the row of the last success of the same size class.
// placer.h lists the departures.
#pragma once

#include <optional>
#include <span>

#include "common/pack/mask_set.h"

namespace kiln {

struct PackSettings {
  uint32_t max_page_size = 8192;  // texels, of either side
  uint32_t max_pages = 64;
  bool power_of_two = false;  // page sizes; else multiples of size_multiple and of the cell
  bool turn = true;           // masks may be turned by 90 degrees
  // A bit of a mask is a cell of this many texels a side, a power of two: 4 keeps items from sharing a block
  // of a block-compressed texture.
  uint32_t cell = 1;
  uint32_t size_multiple = 4;  // texels
};

// Texels. A turned mask has its bit (x, y) at (height - 1 - y, x).
struct PackPlace {
  uint32_t x, y, page;
  bool turned = false;
  bool operator==(const PackPlace&) const = default;
};

// An earlier result, indexed by the current items. Size and number of pages never shrink.
struct PreviousPlaces {
  uint32_t width = 0, height = 0, pages = 0;
  std::vector<std::optional<PackPlace>> places;
};

struct PackResult {
  std::vector<PackPlace> places;              // by item
  uint32_t width = 0, height = 0, pages = 0;  // all pages have one size
  uint32_t kept = 0;                          // items at their previous place
  bool fits = true;  // false: more than max_pages were needed, and the rest is meaningless
};

// Item i has the mask `mask_of_item[i]`, which fits a page in one of its orientations. The result depends on
// nothing but the arguments.
//
// Several pages: their number is settled first, then each item goes to the page with the fewest set bits that
// has a place for it. So as long as every page has room, the set bits of two pages differ by at most those of
// the largest item.
//
// `previous`: items whose place is inside the largest page and not taken by an earlier item stay there. The
// others, largest first, go to the first gap; then below; then to a new page. Without `previous`, items are
// placed by size, so one more item may move every item that is not larger.
PackResult pack_masks(const MaskSet& masks, std::span<const uint32_t> mask_of_item,
                      const PackSettings& settings, const PreviousPlaces* previous = nullptr);

}  // namespace kiln

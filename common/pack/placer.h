// Places items one after another on a fixed number of pages of a fixed width.
//
// Departures from O'Donnell 2018: rows whose longest free run is too short are skipped; the sweep decides 64
// positions at once by probing some of the mask's bits (all of them for a small chart) before it compares
// whole rows; both orientations of a mask share the sweep; size classes are exact sizes instead of 16 texels;
// and while a work budget lasts, every new mask starts from row 0, which fills gaps before the class's last
// success.
#pragma once

#include "common/pack/pack.h"
#include "common/pack/pack_page.h"

namespace kiln {

struct PlacerLimits {
  uint32_t width = 0, height = 0;  // of a page, bits
  bool turn = true;
  uint64_t sweep_work = 0;  // tests of 64 positions; until then every new mask starts from row 0
};

class Placer {
 public:
  Placer(const MaskSet& masks, const PlacerLimits& limits, uint32_t pages);

  // Places are in bits. False: no page has room above row `limit`.
  bool place_on_emptiest(uint32_t mask, uint32_t limit, PackPlace& place);
  bool place_on_first(uint32_t mask, uint32_t limit, PackPlace& place);
  // Places an item exactly here; false if the place is taken or off the page.
  bool keep(uint32_t mask, const PackPlace& place);
  void add_page();

  uint32_t pages() const { return static_cast<uint32_t>(pages_.size()); }
  uint32_t used_pages() const;  // the emptiest is filled first, so the rest are the last
  uint32_t used_width() const;
  uint32_t used_height() const;
  uint64_t work() const;

 private:
  struct Start {  // where a page's next sweep may begin
    uint32_t mask = ~0u, row = 0;
    uint64_t size = 0;
  };
  void prepare(uint32_t mask);
  bool place_on(uint32_t page, uint32_t limit, PackPlace& place);
  std::vector<uint32_t> by_fill() const;

  const MaskSet& masks_;
  PlacerLimits limits_;
  std::vector<PackPage> pages_;
  std::vector<Start> starts_;  // by page
  uint32_t prepared_ = ~0u;
  MaskSet turned_;  // the prepared mask
  std::vector<PackShape> shapes_;
};

}  // namespace kiln

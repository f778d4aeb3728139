#include "common/pack/placer.h"

#include <algorithm>
#include <numeric>

namespace kiln {
namespace {

bool same_bits(const MaskView& a, const MaskView& b) {
  return a.width == b.width && a.height == b.height &&
         std::equal(a.words, a.words + size_t{a.words_per_row()} * a.height, b.words);
}

}  // namespace

Placer::Placer(const MaskSet& masks, const PlacerLimits& limits, uint32_t pages)
    : masks_(masks), limits_(limits) {
  for (uint32_t p = 0; p < pages; ++p) add_page();
}

void Placer::add_page() {
  pages_.emplace_back(limits_.width, limits_.height);
  starts_.emplace_back();
}

void Placer::prepare(uint32_t mask) {
  if (mask == prepared_) return;
  prepared_ = mask;
  const MaskView upright = masks_[mask];
  shapes_.clear();
  turned_.clear();
  if (limits_.turn) turned_.add_turned(upright);
  const bool differs = limits_.turn && !same_bits(turned_[0], upright);
  shapes_.emplace_back(upright, false);
  if (differs) shapes_.emplace_back(turned_[0], true);
  // The flat orientation first: it wins where both fit.
  if (differs && upright.height > upright.width) std::swap(shapes_[0], shapes_[1]);
}

bool Placer::place_on(uint32_t page, uint32_t limit, PackPlace& place) {
  const MaskView mask = masks_[prepared_];
  const uint64_t size = uint64_t{std::max(mask.width, mask.height)} << 32 | std::min(mask.width, mask.height);
  Start& start = starts_[page];
  const bool same = start.mask == prepared_;  // where it did not fit before, it does not fit now
  const bool like = start.size == size && work() >= limits_.sweep_work;
  PackPage::Place found;
  if (!pages_[page].find(shapes_, same || like ? start.row : 0, limit, found)) return false;
  const PackShape& shape = shapes_[found.shape];
  pages_[page].insert(shape.mask, found.x, found.y);
  start = {prepared_, found.y, size};
  place = {found.x, found.y, page, shape.turned};
  return true;
}

std::vector<uint32_t> Placer::by_fill() const {
  std::vector<uint32_t> order(pages_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return pages_[a].used_bits() < pages_[b].used_bits(); });
  return order;
}

bool Placer::place_on_emptiest(uint32_t mask, uint32_t limit, PackPlace& place) {
  prepare(mask);
  if (pages_.size() == 1) return place_on(0, limit, place);
  for (uint32_t page : by_fill())
    if (place_on(page, limit, place)) return true;
  return false;
}

bool Placer::place_on_first(uint32_t mask, uint32_t limit, PackPlace& place) {
  prepare(mask);
  for (uint32_t page = 0; page < pages_.size(); ++page)
    if (place_on(page, limit, place)) return true;
  return false;
}

bool Placer::keep(uint32_t mask, const PackPlace& place) {
  if (place.page >= pages_.size() || (place.turned && !limits_.turn)) return false;
  MaskSet turned;
  if (place.turned) turned.add_turned(masks_[mask]);
  const MaskView view = place.turned ? turned[0] : masks_[mask];
  if (uint64_t{place.x} + view.width > limits_.width || uint64_t{place.y} + view.height > limits_.height)
    return false;
  PackPage& page = pages_[place.page];
  if (!page.is_free(view, place.x, place.y)) return false;
  page.insert(view, place.x, place.y);
  return true;
}

uint32_t Placer::used_pages() const {
  return static_cast<uint32_t>(
      std::count_if(pages_.begin(), pages_.end(), [](const PackPage& page) { return page.used_bits() > 0; }));
}

uint32_t Placer::used_width() const {
  uint32_t width = 0;
  for (const PackPage& page : pages_) width = std::max(width, page.used_width());
  return width;
}

uint32_t Placer::used_height() const {
  uint32_t height = 0;
  for (const PackPage& page : pages_) height = std::max(height, page.used_height());
  return height;
}

uint64_t Placer::work() const {
  uint64_t work = 0;
  for (const PackPage& page : pages_) work += page.work();
  return work;
}

}  // namespace kiln

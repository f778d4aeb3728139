#include "common/pack/pack.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/pack/placer.h"

namespace kiln {
namespace {

// Work is counted in tests of 64 positions, about 3 ns each, rather than in time, so that results do not
// depend on the machine.
constexpr uint64_t kSweepWork = 40'000'000;  // per attempt, after which charts of equal size share a sweep
constexpr uint64_t kTriesWork = 30'000'000;  // after which no further attempt starts
constexpr double kFull = 0.965;              // share of set bits at which the search stops
constexpr double kFullEnough = 0.85;         // and at which the page stays near square
constexpr double kGain = 0.03;               // saving required of a page far from square

// A page to try, in bits.
struct Frame {
  uint32_t width, height;
  double gain = 0;  // required saving, as a share of the smallest area so far
};

struct Level {
  const MaskSet& masks;
  std::span<const uint32_t> mask_of_item;
  const PackSettings& settings;
  uint32_t largest;   // side of a page, bits
  uint32_t multiple;  // of sides, bits
  uint64_t bits = 0;
  uint32_t least_width = 1;  // no narrower page holds all items
  uint32_t longest = 1;      // side of a mask

  uint32_t round_up(uint64_t side) const {
    return static_cast<uint32_t>(std::min<uint64_t>((side + multiple - 1) / multiple * multiple, largest));
  }
};

Level describe(const MaskSet& masks, std::span<const uint32_t> mask_of_item, const PackSettings& settings) {
  Level level{masks, mask_of_item, settings, settings.max_page_size / settings.cell,
              std::max(settings.size_multiple / settings.cell, 1u)};
  if (settings.power_of_two) {
    level.largest = std::bit_floor(level.largest);
    level.multiple = 1;
  }
  std::vector<uint32_t> counts(masks.size());
  for (uint32_t m = 0; m < masks.size(); ++m) counts[m] = static_cast<uint32_t>(masks[m].count());
  for (uint32_t m : mask_of_item) {
    const MaskView mask = masks[m];
    const uint32_t most = std::max(mask.width, mask.height), least = std::min(mask.width, mask.height);
    KILN_CHECK(most <= level.largest);
    level.bits += counts[m];
    level.longest = std::max(level.longest, most);
    level.least_width = std::max(level.least_width, settings.turn ? least : mask.width);
  }
  return level;
}

enum class Order { kLongest, kBox };

// Large to small; items of one mask stay neighbours.
std::vector<uint32_t> placing_order(const Level& level, Order by) {
  const auto key = [&](uint32_t item) {
    const MaskView mask = level.masks[level.mask_of_item[item]];
    const uint64_t most = std::max(mask.width, mask.height), least = std::min(mask.width, mask.height);
    return by == Order::kLongest ? most << 32 | least : most * least << 16 | most;
  };
  std::vector<std::pair<uint64_t, uint32_t>> keys(level.mask_of_item.size());
  for (uint32_t i = 0; i < keys.size(); ++i) keys[i] = {key(i), i};
  std::sort(keys.begin(), keys.end(), [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first > b.first;
    const uint32_t p = level.mask_of_item[a.second], q = level.mask_of_item[b.second];
    return p != q ? p < q : a.second < b.second;
  });
  std::vector<uint32_t> order(keys.size());
  for (size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].second;
  return order;
}

// Near square at 97 % full, then some wider and narrower. Then, if those are too empty, shapes suited to the
// content: the height follows from the width. The first is just wide enough for the longest charts to lie
// along its rows.
std::vector<Frame> frames_of_any_size(const Level& level, uint32_t pages) {
  const double side = std::sqrt(static_cast<double>(level.bits) / (0.97 * pages));
  std::vector<Frame> frames;
  const auto add = [&](double wanted, double gain) {
    const auto most = static_cast<uint64_t>(std::ceil(std::min(wanted, double{1.0} * level.largest)));
    const uint32_t width = level.round_up(std::max<uint64_t>(most, level.least_width));
    if (uint64_t{pages} * width * level.largest >= level.bits) frames.push_back({width, level.largest, gain});
  };
  for (double stretch : {1.0, 0.96, 1.04, 0.92, 1.08, 0.88, 1.12, 0.84, 1.16}) add(side * stretch, 0);
  if (level.longest > side) add(level.longest, kGain);
  for (double stretch : {1.25, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 6.0, 8.0, 0.7, 0.5, 0.25})
    add(side * stretch, kGain);
  frames.push_back({level.largest, level.largest});  // fallback if nothing else fits
  return frames;
}

// Squares and pages twice as wide as high, small to large.
std::vector<Frame> frames_of_powers(const Level& level, uint32_t pages) {
  std::vector<Frame> frames;
  for (uint32_t width = 1; width <= level.largest; width *= 2)
    for (uint32_t height : {width / 2, width})
      if (height && width >= level.least_width && uint64_t{pages} * width * height >= level.bits)
        frames.push_back({width, height});
  return frames;
}

bool try_frame(const Level& level, const std::vector<uint32_t>& order, const Frame& frame, uint32_t pages,
               PackResult& result, uint64_t& work) {
  Placer placer(level.masks, {frame.width, frame.height, level.settings.turn, kSweepWork}, pages);
  bool fits = true;
  result.places.resize(order.size());
  for (size_t k = 0; k < order.size() && fits; ++k)
    fits = placer.place_on_emptiest(level.mask_of_item[order[k]], frame.height, result.places[order[k]]);
  work += placer.work();
  if (!fits) return false;
  const bool powers = level.settings.power_of_two;
  result.width = powers ? frame.width : level.round_up(placer.used_width());
  result.height = powers ? frame.height : level.round_up(placer.used_height());
  result.pages = placer.used_pages();
  return true;
}

uint64_t area(const PackResult& r) {
  return uint64_t{r.width} * r.height * r.pages;
}

bool is_full(const Level& level, const PackResult& r, double share) {
  return static_cast<double>(level.bits) >= share * static_cast<double>(area(r));
}

// The smallest area over some orders and widths; false if no page size works.
bool pack_on(const Level& level, uint32_t pages, PackResult& best) {
  const std::vector<uint32_t> orders[] = {placing_order(level, Order::kLongest),
                                          placing_order(level, Order::kBox)};
  const bool powers = level.settings.power_of_two;
  const std::vector<Frame> frames =
      powers ? frames_of_powers(level, pages) : frames_of_any_size(level, pages);
  bool any = false;
  uint64_t work = 0;
  for (const Frame& frame : frames) {
    const bool last = &frame == &frames.back();  // for items that fit nowhere else
    for (const std::vector<uint32_t>& order : orders) {
      if (any && (powers || last || work > kTriesWork || is_full(level, best, kFull))) return true;
      if (any && frame.gain > 0 && is_full(level, best, kFullEnough)) return true;
      if (!powers && !last && work > kTriesWork) continue;
      PackResult result;
      if (!try_frame(level, order, frame, pages, result, work)) continue;
      const auto allowed = (1 - frame.gain) * static_cast<double>(any ? area(best) : 0);
      if (!any || static_cast<double>(area(result)) < allowed) best = std::move(result);
      any = true;
    }
  }
  return any;
}

PackResult pack_anew(const Level& level) {
  const double page = static_cast<double>(level.largest) * level.largest;
  // With many charts, pages that would have to be more than 98.5 % full are not attempted.
  const bool many = level.mask_of_item.size() > 4096 && static_cast<double>(level.bits) > page;
  const double least = std::ceil(static_cast<double>(level.bits) / (many ? 0.985 * page : page));
  PackResult result;
  for (double pages = std::max(1.0, least); pages <= level.settings.max_pages; ++pages)
    if (pack_on(level, static_cast<uint32_t>(pages), result)) return result;
  result.fits = false;
  return result;
}

PackResult pack_around(const Level& level, const PreviousPlaces& previous) {
  const PackSettings& settings = level.settings;
  const uint32_t cell = settings.cell;
  const auto side = [&](uint64_t bits) {
    return settings.power_of_two
               ? static_cast<uint32_t>(std::min<uint64_t>(std::bit_ceil(bits), level.largest))
               : level.round_up(bits);
  };
  const uint32_t width = side(std::max((previous.width + cell - 1) / cell, level.least_width));
  const uint32_t least_height = side((previous.height + cell - 1) / cell);
  Placer placer(level.masks, {width, level.largest, settings.turn, kSweepWork},
                std::clamp(previous.pages, 1u, settings.max_pages));
  PackResult result;
  result.places.resize(level.mask_of_item.size());
  std::vector<bool> placed(result.places.size());
  for (uint32_t i = 0; i < result.places.size(); ++i) {
    if (i >= previous.places.size() || !previous.places[i]) continue;
    PackPlace at = *previous.places[i];
    if (at.x % cell || at.y % cell) continue;
    at.x /= cell;
    at.y /= cell;
    if (!placer.keep(level.mask_of_item[i], at)) continue;
    result.places[i] = at;
    placed[i] = true;
    ++result.kept;
  }
  for (uint32_t i : placing_order(level, Order::kLongest)) {
    if (placed[i]) continue;
    const uint32_t mask = level.mask_of_item[i];
    const uint32_t height = std::max(least_height, side(placer.used_height()));
    if (placer.place_on_first(mask, height, result.places[i]) ||
        placer.place_on_emptiest(mask, level.largest, result.places[i]))
      continue;
    if (placer.pages() == settings.max_pages) {
      result.fits = false;
      return result;
    }
    placer.add_page();
    placer.place_on_emptiest(mask, level.largest, result.places[i]);
  }
  result.width = width;
  result.height = std::max(least_height, side(placer.used_height()));
  result.pages = placer.pages();
  return result;
}

}  // namespace

PackResult pack_masks(const MaskSet& masks, std::span<const uint32_t> mask_of_item,
                      const PackSettings& settings, const PreviousPlaces* previous) {
  const Level level = describe(masks, mask_of_item, settings);
  const bool around = previous && previous->width && previous->height && previous->pages;
  PackResult result = around ? pack_around(level, *previous) : pack_anew(level);
  result.width *= settings.cell;
  result.height *= settings.cell;
  for (PackPlace& place : result.places) {
    place.x *= settings.cell;
    place.y *= settings.cell;
  }
  return result;
}

}  // namespace kiln

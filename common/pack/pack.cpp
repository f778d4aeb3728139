// O'Donnell 2018, "Precomputed Global Illumination in Frostbite", atlas packing, and Roughton 2019, 4.1.3:
// largest first, row sweep on bit masks, start from the row of the last success of the same size class.
// Departures: the sweep decides 64 positions at once by probing some of the mask's bits (all of them for a
// small chart) before it compares whole rows; size classes are an eighth of an octave instead of 16 texels,
// as the sweep is cheap enough to restart that often; rows that are too full for the mask are skipped.
#include "common/pack/pack.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"

namespace kiln {
namespace {

struct Probe {
  uint32_t x, y;
};

// A few set bits of a mask, far apart first.
struct Probes {
  std::vector<Probe> probes;
  bool complete = false;  // they are all its bits
};

Probes choose_probes(const BitImage& mask) {
  constexpr size_t kMost = 40;
  std::vector<Probe> bits;
  for (uint32_t y = 0; y < mask.height(); ++y)
    for (uint32_t w = 0; w < mask.words_per_row(); ++w)
      for (uint64_t word = mask.row(y)[w]; word; word &= word - 1)
        bits.push_back({64 * w + static_cast<uint32_t>(std::countr_zero(word)), y});
  Probes chosen;
  chosen.complete = bits.size() <= kMost;
  const size_t count = std::min(bits.size(), kMost);
  if (count == 0) return chosen;
  // Multiples of the golden ratio spread over the list however many are asked for before one fails.
  std::vector<bool> taken(bits.size());
  for (size_t k = 0; chosen.probes.size() < count; ++k) {
    const double turn = static_cast<double>(k) * 0.6180339887498949;
    size_t i = static_cast<size_t>((turn - std::floor(turn)) * static_cast<double>(bits.size()));
    while (taken[i]) i = (i + 1) % bits.size();
    taken[i] = true;
    chosen.probes.push_back(bits[i]);
  }
  return chosen;
}

class Page {
 public:
  Page(uint32_t width, uint32_t max_height) : bits_(width, 0), max_height_(max_height) {}

  uint32_t used_height() const { return used_height_; }

  // First place at or after row `y`, in row order; false if there is none.
  bool find(const BitImage& mask, const Probes& probes, uint32_t y, PackPlace& place) {
    if (mask.height() > max_height_) return false;
    uint32_t least_free = 0;
    for (uint32_t w = 0; w < mask.words_per_row(); ++w)
      least_free += static_cast<uint32_t>(std::popcount(mask.row(0)[w]));
    const uint32_t last = std::min(used_height_, max_height_ - mask.height());
    bits_.grow(last + mask.height());
    free_.resize(bits_.height(), bits_.width());
    for (; y <= last; ++y) {
      if (free_[y] < least_free) continue;
      if (find_in_row(mask, probes, y, place.x)) {
        place.y = y;
        return true;
      }
    }
    return false;
  }

  void insert(const BitImage& mask, const PackPlace& place) {
    const uint32_t shift = place.x % 64;
    for (uint32_t r = 0; r < mask.height(); ++r) {
      uint64_t* to = bits_.row(place.y + r) + place.x / 64;
      for (uint32_t w = 0; w < mask.words_per_row(); ++w) {
        const uint64_t word = mask.row(r)[w];
        to[w] |= word << shift;
        if (shift) to[w + 1] |= word >> (64 - shift);
        free_[place.y + r] -= static_cast<uint32_t>(std::popcount(word));
      }
    }
    used_height_ = std::max(used_height_, place.y + mask.height());
  }

 private:
  bool find_in_row(const BitImage& mask, const Probes& probes, uint32_t y, uint32_t& x) const {
    const uint32_t positions = bits_.width() - mask.width() + 1;
    for (uint32_t block = 0; block < positions; block += 64) {
      uint64_t open = positions - block >= 64 ? ~uint64_t{0} : (uint64_t{1} << (positions - block)) - 1;
      for (const Probe& p : probes.probes) {
        open &= ~bits_from(bits_.row(y + p.y), block + p.x);
        if (!open) break;
      }
      for (; open; open &= open - 1) {
        x = block + static_cast<uint32_t>(std::countr_zero(open));
        if (probes.complete || is_free(mask, x, y)) return true;
      }
    }
    return false;
  }

  bool is_free(const BitImage& mask, uint32_t x, uint32_t y) const {
    for (uint32_t r = 0; r < mask.height(); ++r) {
      const uint64_t* page = bits_.row(y + r);
      const uint64_t* row = mask.row(r);
      for (uint32_t w = 0; w < mask.words_per_row(); ++w)
        if (row[w] && bits_from(page, x + 64 * w) & row[w]) return false;
    }
    return true;
  }

  BitImage bits_;
  std::vector<uint32_t> free_;  // by row
  uint32_t max_height_, used_height_ = 0;
};

uint32_t round_up(uint64_t value, uint32_t multiple, uint32_t most) {
  return static_cast<uint32_t>(std::min<uint64_t>((value + multiple - 1) / multiple * multiple, most));
}

uint32_t page_width(std::span<const BitImage* const> items, const PackSettings& settings) {
  uint64_t texels = 0, count = 0;
  uint32_t widest = 1;
  const BitImage* counted = nullptr;
  for (const BitImage* item : items) {
    if (item != counted) count = item->count();
    counted = item;
    texels += count;
    widest = std::max(widest, item->width());
  }
  // Near square at 97 % full.
  const auto side = static_cast<uint64_t>(std::ceil(std::sqrt(static_cast<double>(texels) / 0.97)));
  return round_up(std::max<uint64_t>(side, widest), settings.size_multiple, settings.max_page_size);
}

uint32_t size_class(const BitImage& mask) {
  const uint64_t sum = uint64_t{mask.width()} + mask.height();
  const int octave = std::bit_width(sum) - 1;
  return static_cast<uint32_t>(8 * octave + static_cast<int>((sum << 3 >> octave) & 7));
}

// Large to small; equal masks stay neighbours.
std::vector<uint32_t> placing_order(std::span<const BitImage* const> items) {
  std::vector<uint32_t> order(items.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const BitImage &p = *items[a], &q = *items[b];
    const uint32_t sum_p = p.width() + p.height(), sum_q = q.width() + q.height();
    if (sum_p != sum_q) return sum_p > sum_q;
    if (p.height() != q.height()) return p.height() > q.height();
    return a < b;
  });
  return order;
}

}  // namespace

PackResult pack_masks(std::span<const BitImage* const> items, const PackSettings& settings) {
  PackResult result;
  result.places.resize(items.size());
  result.width = page_width(items, settings);
  std::vector<Page> pages;
  const BitImage* previous = nullptr;
  uint32_t previous_class = 0;
  Probes probes;
  PackPlace start{0, 0, 0};
  for (uint32_t i : placing_order(items)) {
    const BitImage& mask = *items[i];
    KILN_CHECK(mask.width() <= result.width && mask.height() <= settings.max_page_size);
    if (&mask != previous) probes = choose_probes(mask);
    if (!previous || size_class(mask) < previous_class) start = {0, 0, 0};
    previous = &mask;
    previous_class = size_class(mask);
    PackPlace& place = result.places[i];
    for (place.page = start.page;; ++place.page) {
      if (place.page == pages.size()) {
        if (pages.size() == settings.max_pages) {
          result.fits = false;
          return result;
        }
        pages.emplace_back(result.width, settings.max_page_size);
      }
      if (pages[place.page].find(mask, probes, place.page == start.page ? start.y : 0, place)) break;
    }
    pages[place.page].insert(mask, place);
    start = place;
  }
  for (const Page& page : pages) result.height = std::max(result.height, page.used_height());
  result.height = round_up(result.height, settings.size_multiple, settings.max_page_size);
  result.pages = static_cast<uint32_t>(pages.size());
  return result;
}

}  // namespace kiln

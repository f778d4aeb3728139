// Windows of sites, kept between loops that walk through the same ones.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "common/base/parallel.h"

namespace kiln {

// Each site of a window is kept as the difference of its number from the first one's, in two bytes. Nothing
// is kept of a window whose sites are too far apart for that, nor of maps of more than kMostSites sites,
// whose windows would take a gigabyte.
class KeptWindows {
 public:
  explicit KeptWindows(size_t sites) {
    if (sites > kMostSites) return;
    place_.resize(sites);
    runs_.resize((sites + kParallelRun - 1) / kParallelRun);
  }

  // Writes the window that was kept for a site to `out`, which has room for it, and returns its size; 0:
  // none.
  size_t find(uint32_t site, std::span<uint32_t> out) const {
    if (place_.empty()) return 0;
    const Place& place = place_[site];
    const int16_t* step = runs_[site / kParallelRun].data() + place.first;
    for (size_t i = 0; i < place.count; ++i) out[i] = site + static_cast<uint32_t>(int32_t{step[i]});
    return place.count;
  }

  // `window` begins with the site, of which none was kept before, and has at most 65,535 sites. Several
  // threads may keep windows of different runs of kParallelRun sites.
  void keep(std::span<const uint32_t> window) {
    if (place_.empty()) return;
    const uint32_t site = window[0];
    std::vector<int16_t>& steps = runs_[site / kParallelRun];
    const size_t first = steps.size();
    for (const uint32_t other : window) {
      const int64_t step = int64_t{other} - int64_t{site};
      if (step < std::numeric_limits<int16_t>::min() || step > std::numeric_limits<int16_t>::max())
        return steps.resize(first);
      steps.push_back(static_cast<int16_t>(step));
    }
    place_[site] = {static_cast<uint32_t>(first), static_cast<uint16_t>(window.size())};
  }

 private:
  static constexpr size_t kMostSites = size_t{1} << 22;
  struct Place {
    uint32_t first = 0;
    uint16_t count = 0;
  };
  std::vector<Place> place_;                // by site
  std::vector<std::vector<int16_t>> runs_;  // by run: steps of its windows
};

}  // namespace kiln

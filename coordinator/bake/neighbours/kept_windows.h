// Windows around sites (surface_window.h), kept for the loops that need them again.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "common/base/parallel.h"

namespace kiln {

// Two bytes for each site of a window: its number less that of the site in the middle. Windows for which two
// bytes are too few are not kept, and none of maps with more than kMostSites sites (a gigabyte).
class KeptWindows {
 public:
  explicit KeptWindows(size_t sites) {
    if (sites > kMostSites) return;
    place_.resize(sites);
    runs_.resize((sites + kParallelRun - 1) / kParallelRun);
  }

  // Writes the window of a site to `out`, which has room for it, and returns its size; 0 if it is not kept.
  size_t find(uint32_t site, std::span<uint32_t> out) const {
    if (place_.empty()) return 0;
    const Place& place = place_[site];
    const int16_t* step = runs_[site / kParallelRun].data() + place.first;
    for (size_t i = 0; i < place.count; ++i) out[i] = site + static_cast<uint32_t>(int32_t{step[i]});
    return place.count;
  }

  // `window`: its site first, at most 65,535; once for each site. Threads may share runs of kParallelRun
  // sites between them, one thread for each run.
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

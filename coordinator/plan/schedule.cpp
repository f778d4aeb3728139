#include "coordinator/plan/schedule.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {

std::vector<SampleRange> sample_passes(uint32_t min_samples, uint32_t max_samples) {
  KILN_CHECK(min_samples >= 1 && min_samples <= max_samples);
  std::vector<SampleRange> passes{{0, min_samples}};
  for (uint64_t done = min_samples; done < max_samples;) {
    const uint64_t next = std::min<uint64_t>(2 * done, max_samples);
    passes.push_back({static_cast<uint32_t>(done), static_cast<uint32_t>(next - done)});
    done = next;
  }
  return passes;
}

std::vector<SampleRange> ranges_of(SampleRange pass) {
  std::vector<SampleRange> ranges;
  for (uint32_t done = 0; done < pass.count; done += kRangeSamples)
    ranges.push_back({pass.first + done, std::min(kRangeSamples, pass.count - done)});
  return ranges;
}

std::vector<WorkUnit> cut_pass(const std::vector<uint32_t>& sites, SampleRange pass, uint32_t tile_texels,
                               uint64_t& next_id) {
  constexpr uint64_t kMostSites = 32768;  // of one unit: keeps a result within a data frame
  std::vector<WorkUnit> units;
  const std::vector<SampleRange> ranges = ranges_of(pass);
  const uint64_t widest = ranges.front().count;
  const size_t run = static_cast<size_t>(
      std::clamp<uint64_t>(uint64_t{tile_texels} * 256 / std::max<uint64_t>(widest, 64), 1, kMostSites));
  for (size_t begin = 0; begin < sites.size(); begin += run) {
    const size_t end = std::min(sites.size(), begin + run);
    for (const SampleRange& range : ranges) {
      WorkUnit unit;
      unit.id = next_id++;
      unit.first_sample = range.first;
      unit.sample_count = range.count;
      unit.sites.assign(sites.begin() + begin, sites.begin() + end);
      units.push_back(std::move(unit));
    }
  }
  return units;
}

}  // namespace kiln

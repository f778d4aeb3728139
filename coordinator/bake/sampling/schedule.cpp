#include "coordinator/bake/sampling/schedule.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>

namespace kiln {

uint32_t sample_count(double needed) {
  constexpr uint32_t kMax = 1u << 30;
  if (!(needed > 1)) return 1;
  if (needed >= kMax) return kMax;
  const auto least = static_cast<uint32_t>(std::ceil(needed));
  if (least <= 4) return least;
  const uint32_t step = std::bit_floor(least - 1) / 4;
  return (least + step - 1) / step * step;
}

uint32_t pilot_samples(size_t sites) {
  constexpr uint32_t kMost = 16, kLeast = 4;
  constexpr uint64_t kManyInAll = 1u << 19;
  uint32_t count = kMost;
  while (count > kLeast && uint64_t{sites} * (count / 2) >= kManyInAll) count /= 2;
  return count;
}

uint32_t pilot_stride(size_t sites) {
  constexpr size_t kManySites = size_t{1} << 20;
  return sites < kManySites ? 1 : 2;
}

std::vector<SiteSamples> work_towards(std::span<const double> needed, std::span<const uint32_t> have,
                                      uint32_t most, double least) {
  std::vector<SiteSamples> work;
  for (uint32_t site = 0; site < needed.size(); ++site) {
    const uint32_t now = have[site];
    if (!(needed[site] > now) || now == 0 || now >= most) continue;
    const double wanted = std::clamp(needed[site], least * now, kGrowth * now);
    const uint32_t to = std::min(sample_count(wanted), most);
    if (to > now) work.push_back({site, {now, to - now}});
  }
  return work;
}

double samples_of(std::span<const SiteSamples> work) {
  double samples = 0;
  for (const SiteSamples& s : work) samples += kReplicates * s.range.count;
  return samples;
}

std::vector<SampleRange> ranges_of(SampleRange pass) {
  std::vector<SampleRange> ranges;
  for (uint32_t done = 0; done < pass.count; done += kRangeSamples)
    ranges.push_back({pass.first + done, std::min(kRangeSamples, pass.count - done)});
  return ranges;
}

std::vector<WorkUnit> cut_pass(const std::vector<SiteSamples>& work, uint32_t tile_texels,
                               std::span<const Digest> caches, uint64_t& next_id) {
  constexpr uint64_t kMaxSites = 32768;  // per unit: keeps a result within one data frame
  std::vector<WorkUnit> units;
  // Keyed by first sample, count and take.
  std::map<std::tuple<uint32_t, uint32_t, uint32_t>, std::vector<uint32_t>> sites_of;
  for (const SiteSamples& s : work)
    if (s.range.count > 0) sites_of[{s.range.first, s.range.count, s.take}].push_back(s.site);
  for (const auto& entry : sites_of) {
    const std::vector<uint32_t>& sites = entry.second;
    const auto [begin_sample, count, take] = entry.first;
    const std::vector<SampleRange> ranges = ranges_of({begin_sample, count});
    const uint64_t widest = ranges.front().count;
    const size_t run = static_cast<size_t>(
        std::clamp<uint64_t>(uint64_t{tile_texels} * 256 / std::max<uint64_t>(widest, 64), 1, kMaxSites));
    for (size_t begin = 0; begin < sites.size(); begin += run) {
      const auto first = sites.begin() + static_cast<ptrdiff_t>(begin);
      const auto last = sites.begin() + static_cast<ptrdiff_t>(std::min(sites.size(), begin + run));
      for (const SampleRange& range : ranges)
        for (uint32_t replicate = 0; replicate < kReplicates; ++replicate) {
          WorkUnit unit;
          unit.id = next_id++;
          unit.first_sample = range.first;
          unit.sample_count = range.count;
          unit.replicate = replicate;
          unit.take = take;
          if (!caches.empty()) unit.cache = caches[replicate];
          unit.sites.assign(first, last);
          units.push_back(std::move(unit));
        }
    }
  }
  return units;
}

void order_by_gain(const TexelErrors& errors, std::vector<WorkUnit>& units) {
  if (errors.mean.empty()) return;
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < units.size(); ++i) {
    double gain = 0;
    for (const uint32_t site : units[i].sites) {
      const double mean = errors.mean[site], error = errors.standard_error[site];
      if (mean > 0 && std::isfinite(error)) gain += error * error / (mean * mean);
    }
    // In powers of two: smaller differences do not justify jumping across the scene.
    order.emplace_back(
        gain > 0 ? -std::floor(std::log2(gain / static_cast<double>(units[i].sites.size()))) : 1e9, i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<WorkUnit> sorted;
  sorted.reserve(units.size());
  for (const auto& entry : order) sorted.push_back(std::move(units[entry.second]));
  units = std::move(sorted);
}

}  // namespace kiln

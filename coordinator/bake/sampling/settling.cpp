#include "coordinator/bake/sampling/settling.h"

#include <algorithm>

namespace kiln {

std::vector<SiteSamples> Settling::next(const SettlingState& state) {
  std::vector<SiteSamples> work;
  const double settled = kSettledPart * kSettledPart * state.error * state.error;
  double now = 0, taken = 0, sampled = 0;
  for (uint32_t site = 0; site < state.shared.size(); ++site) {
    if (state.samples[site] == 0) continue;
    ++sampled;
    if (!(state.shared[site] > settled)) continue;
    now += double{state.shared[site]};
    work.push_back({site, {0, state.samples[site]}});
  }
  if (!(now > settled * sampled)) return {};
  const uint32_t factor = now < kSettlingHelps * before_ ? 1 : 2;
  before_ = now;
  for (SiteSamples& s : work) {
    s.range.count = std::min(factor * s.range.count, state.most);
    taken += double{kReplicates} * s.range.count;
  }
  taken_ += taken;
  if (taken > kSettlingRound * state.to_come || taken_ > kSettlingShare * state.to_come) work.clear();
  return work;
}

}  // namespace kiln

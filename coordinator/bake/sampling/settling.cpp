#include "coordinator/bake/sampling/settling.h"

#include <algorithm>

namespace kiln {
namespace {

double settled_square(const SettlingState& s) {
  return kSettledPart * kSettledPart * s.error * s.error;
}

// Squared shared error as it counts in the norm.
double counted_square(const SettlingState& s, size_t site) {
  if (s.mean.empty() || s.mean[site] >= s.floor) return s.shared[site];
  const double part = std::max(0.0, s.mean[site] / s.floor);
  return part * part * s.shared[site];
}

}  // namespace

double unsettled_share(const SettlingState& state) {
  size_t sampled = 0, unsettled = 0;
  for (size_t site = 0; site < state.shared.size(); ++site) {
    if (state.samples[site] == 0) continue;
    ++sampled;
    unsettled += counted_square(state, site) > settled_square(state);
  }
  return sampled ? static_cast<double>(unsettled) / static_cast<double>(sampled) : 0;
}

std::vector<SiteSamples> Settling::next(const SettlingState& state) {
  std::vector<SiteSamples> work;
  left_out_.clear();
  is_out_.resize(state.shared.size(), 0);
  const double settled = settled_square(state);
  double now = 0, sampled = 0;
  for (uint32_t site = 0; site < state.shared.size(); ++site) {
    if (state.samples[site] == 0) continue;
    ++sampled;
    const double square = counted_square(state, site);
    if (is_out_[site] || !(square > settled)) continue;
    now += square;
    work.push_back({site, {0, state.samples[site]}});
  }
  if (!(now > settled * sampled)) return {};
  const bool helps = now < kSettlingHelps * before_;
  const bool leaves_out = !helps && static_cast<double>(work.size()) <= kLeftOut * sampled;
  const uint32_t factor = helps || leaves_out ? 1 : 2;
  before_ = now;
  for (SiteSamples& s : work) s.range.count = std::min(factor * s.range.count, state.most);
  const double taken = samples_of(work);
  taken_ += taken;
  if (taken > kSettlingRound * state.to_come || taken_ > kSettlingShare * state.to_come) work.clear();
  for (const SiteSamples& s : work) {
    if (!leaves_out) break;
    left_out_.push_back(s.site);
    is_out_[s.site] = 1;
  }
  return work;
}

}  // namespace kiln

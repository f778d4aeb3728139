#include "coordinator/run/nonfinite.h"

#include <algorithm>
#include <tuple>

#include "common/base/format.h"

namespace kiln {

void NonfiniteLog::add(const WorkUnit& unit, const UnitResult& result) {
  if (result.nonfinite == 0) return;
  count_ += result.nonfinite;
  const auto site = std::find_if(unit.sites.begin(), unit.sites.end(),
                                 [&](uint32_t s) { return atlas_.sites.texel[s] == result.nonfinite_texel; });
  if (site == unit.sites.end()) return;  // a position outside the unit is ignored
  const uint32_t texel = result.nonfinite_texel, row = texel / atlas_.width;
  const uint32_t instance = atlas_.sites.words[atlas_.sites.first_word[*site] + 4];  // first triangle
  NonfinitePlace place{texel % atlas_.width,
                       row % atlas_.height,
                       row / atlas_.height,
                       scene_.instances[instance].name,
                       *site,
                       result.nonfinite_sample};
  const auto order = [](const NonfinitePlace& p) { return std::tie(p.page, p.y, p.x, p.sample); };
  const auto at = std::upper_bound(places_.begin(), places_.end(), place,
                                   [&](const auto& a, const auto& b) { return order(a) < order(b); });
  places_.insert(at, std::move(place));
  if (places_.size() > kMax) places_.pop_back();
}

std::string NonfiniteLog::sentence() const {
  if (count_ == 0) return "";
  std::string out = text("{} samples exceed the range of a float and were dropped", count_);
  if (places_.empty()) return out;
  const NonfinitePlace& p = places_.front();
  return out + text(": the first at texel ({}, {}) of page {}, '{}', sample {}", p.x, p.y, p.page, p.instance,
                    p.sample);
}

}  // namespace kiln

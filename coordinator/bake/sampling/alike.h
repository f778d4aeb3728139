// Texels that share an error in proportion to their light: those of a chart with about as much of it.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/base/parallel.h"
#include "coordinator/bake/lightmap/as_bright.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

constexpr size_t kAlikeReach = 64;  // sites in Morton order, on either side

// Runs of sites, so that those of even light need not be visited one by one.
constexpr size_t kAlikeRun = 16;
class AlikeRuns {
 public:
  AlikeRuns(const TexelStatistics& s, std::span<const uint32_t> chart_of_site)
      : runs_((s.sites + kAlikeRun - 1) / kAlikeRun) {
    for_each_index(s.sites / kAlikeRun, 0, [&](size_t r) {
      Run run{mean_luminance(s, r * kAlikeRun), 0, chart_of_site[r * kAlikeRun], true};
      for (size_t j = r * kAlikeRun; j < (r + 1) * kAlikeRun; ++j) {
        const double light = mean_luminance(s, j);
        run.least = std::min(run.least, light);
        run.most = std::max(run.most, light);
        run.is_whole &= s.known[j] && chart_of_site[j] == run.chart;
      }
      runs_[r] = run;
    });
  }
  size_t count() const { return runs_.size(); }
  // Whether all sites of a run are known, of that chart, and have about that much light whatever their
  // errors.
  bool are_alike(size_t run, uint32_t chart, double light) const {
    const Run& r = runs_[run];
    return r.is_whole && r.chart == chart && is_as_bright(light, r.least, 0) &&
           is_as_bright(light, r.most, 0);
  }

 private:
  struct Run {
    double least = 0, most = 0;  // mean luminance
    uint32_t chart = 0;
    bool is_whole = false;
  };
  std::vector<Run> runs_;
};

// Visits site i and the known sites alike, as runs where whole runs are. None if site i has no light.
template <class Visit, class VisitRun>
void for_each_alike(const TexelStatistics& s, std::span<const uint32_t> chart_of_site, const AlikeRuns& runs,
                    size_t i, const Visit& visit, const VisitRun& visit_run) {
  const auto square_of_error = [&](size_t j) { return double{s.variance[j]} / (kReplicates * s.samples[j]); };
  if (!s.known[i] || !(mean_luminance(s, i) > 0)) return;
  const double own = mean_luminance(s, i), error = square_of_error(i);
  const size_t last = std::min(s.sites, i + kAlikeReach + 1);
  for (size_t j = i > kAlikeReach ? i - kAlikeReach : 0; j < last; ++j) {
    if (j % kAlikeRun == 0 && j + kAlikeRun <= last && runs.are_alike(j / kAlikeRun, chart_of_site[i], own)) {
      visit_run(j / kAlikeRun);
      j += kAlikeRun - 1;
      continue;
    }
    if (!s.known[j] || chart_of_site[j] != chart_of_site[i]) continue;
    const double light = mean_luminance(s, j);
    // Most are, whatever their errors.
    if (is_as_bright(own, light, 0) || is_as_bright(own, light, std::max(error, square_of_error(j))))
      visit(j);
  }
}

}  // namespace kiln

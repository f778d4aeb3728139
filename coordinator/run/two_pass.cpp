#include "coordinator/run/two_pass.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/format.h"
#include "common/base/statistics.h"
#include "common/job/irradiance_cache.h"
#include "common/math/sequence.h"
#include "coordinator/bake/collapse/same_charts.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/pace.h"
#include "coordinator/bake/sampling/schedule.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/time_budget.h"

namespace kiln {
namespace {

constexpr uint64_t kFirstPassKey = 0x74776f2d70617373;  // keys its random numbers
// Share of the passes' time that the first pass and the second layout may take. They start only if
// they are expected to take half of it, because the prediction is a guess.
constexpr double kTimeShare = 0.4;

struct FirstPass {
  TexelStatistics whole;   // whole paths
  TexelStatistics gather;  // paths that end at the light found by `whole`
  FarmStatistics farm;
  bool complete = false;  // false: ran out of time
};

// Runs the first pass: the same samples of every site, once for each set of caches.
class FirstPassJob {
 public:
  FirstPassJob(const TwoPassTask& task, const JobSpec& spec, size_t sites, FarmJob& farm, double seconds)
      : task_(task), spec_(spec), farm_(farm), pace_(seconds) {
    for (uint32_t site = 0; site < sites; ++site) work_.push_back({site, {0, kFirstPassSamples}});
  }

  Status run(bool cache, FirstPass& pass) {
    for (;;) {
      next_unit_ = units_before(spec_.atlas, 0) + 1;
      Accumulator sums(work_.size(), MomentLayout(spec_.transport.basis, spec_.transport.quantities));
      KILN_TRY(PassEnd end, step(0, {}, sums));
      if (end == PassEnd::kComplete) pass.whole = sums.statistics();
      if (end == PassEnd::kComplete && cache) {
        std::vector<Digest> caches;
        for (uint32_t r = 0; r < kReplicates; ++r)
          caches.push_back(farm_.add_chunk(write_irradiance_cache(sums.cache(r))));
        sums.clear();
        KILN_TRY(end, step(1, caches, sums));
      }
      if (end == PassEnd::kRewound) continue;
      pass.complete = end == PassEnd::kComplete;
      pass.gather = sums.statistics();
      pass.farm = farm_.statistics();
      return {};
    }
  }

 private:
  Expected<PassEnd> step(uint32_t index, std::span<const Digest> caches, Accumulator& sums) {
    uint32_t cut = task_.request.settings.tile_texels;
    if (task_.request.cut) {
      KILN_TRY(cut, task_.request.cut(index, cut));
    }
    PassHandlers handlers;
    handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) {
      return sums.add(unit, result);
    };
    handlers.on_progress = [&](const FarmProgress& f) {
      BakeProgress p;
      p.stage = "first pass";
      p.done = f.weight > 0 ? f.weight_done / f.weight : 0;
      p.rays = f.rays;
      p.workers = f.workers;
      task_.progress(p);
    };
    return farm_.run_pass(cut_pass(work_, cut, caches, next_unit_), pace_.deadline_ms(), handlers);
  }

  const TwoPassTask& task_;
  const JobSpec& spec_;
  FarmJob& farm_;
  const BakePace pace_;
  std::vector<SiteSamples> work_;
  uint64_t next_unit_ = 0;
};

Expected<FirstPass> bake_first_pass(const TwoPassTask& task, const Preflight& pre, double seconds) {
  ChunkStore chunks;
  KILN_TRY(JobSpec spec, make_job(pre, task.request.settings, chunks));
  // Charts are judged by the light itself: a fit to their normals has more noise in each of its numbers.
  KILN_TRY(spec.transport.basis, find_basis(task.request.settings.basis));
  // Charts are not judged by stated errors.
  spec.transport.quantities.cache_draws = false;
  // Samples that decide about a chart must be independent of those that measure it.
  spec.transport.seed = mix_bits(spec.transport.seed ^ kFirstPassKey);
  KILN_TRY(FarmJob* const farm, task.workplace.open(spec, chunks));
  FirstPass pass;
  const Status done =
      FirstPassJob(task, spec, pre.atlas.sites.size(), *farm, seconds).run(pre.plan.cache, pass);
  task.workplace.close();  // before its chunks are destroyed
  if (!done) return tl::unexpected<Error>(done.error());
  return pass;
}

double layout_seconds(const BakeReport& report) {
  double seconds = 0;
  for (const StageTime& s : report.stages)
    if (s.name != "import") seconds += s.seconds;
  return seconds;
}

// Seconds for the first pass; 0: no time for it. Infinite without a limit.
double seconds_for_first_pass(const TwoPassTask& task, const Preflight& pre) {
  TimeBudget budget(task.request, pre, task.watch);
  budget.take_time_for_denoiser();
  const double seconds = kTimeShare * budget.seconds_for_passes() - layout_seconds(task.report);
  const double samples =
      static_cast<double>(kReplicates) * kFirstPassSamples * (pre.plan.cache ? kFirstPassSteps : 1);
  const double expected = pre.plan.least_seconds * samples / std::max(1u, pre.plan.least_samples);
  return 2 * expected <= seconds ? seconds : 0;
}

std::vector<uint8_t> collapse_of(const ChartsToSize& charts, const Atlas& first,
                                 std::span<const uint8_t> reasons) {
  constexpr uint64_t kMinTexels = 4;
  const std::vector<uint32_t> same = same_charts(first, charts.atlas);
  std::vector<uint8_t> out(same.size(), kNotCollapsed);
  for (size_t p = 0; p < same.size(); ++p)
    if (same[p] != kNoChart && charts.texels[p] > kMinTexels) out[p] = reasons[same[p]];
  return out;
}

// Light that a few whole paths miss arrives by way of surfaces that other paths found lit, so a
// chart is black only if neither kind met light.
Expected<std::vector<ChartLight>> judge(const FirstPass& pass, const Atlas& atlas,
                                        const BakeSettings& settings) {
  const std::vector<uint32_t> charts = charts_of_sites(atlas);
  std::vector<ChartLight> light = judge_charts(pass.whole, charts, atlas.placements.size(),
                                               {settings.error, normal_interval(settings.confidence),
                                                even_bands(basis_roster()[*find_basis(settings.basis)])});
  const std::vector<uint8_t> black = black_charts(pass.gather, charts, light.size());
  for (size_t p = 0; p < light.size(); ++p)
    if (light[p].why == kUnlit && !black[p]) light[p].why = kNotCollapsed;
  return light;
}

std::string two_pass_text(const AtlasStatistics& s) {
  const CollapsedCharts &black = s.collapsed[kUnlit], &even = s.collapsed[kEvenlyLit];
  return text(
      "{} of {} charts are lit the same all over and {} are black: {} texels instead of {}, {:.1f} % of the "
      "map (--two-pass on)",
      even.charts, s.charts, black.charts, even.texels + black.texels, even.from + black.from,
      100 * s.share(even.from + black.from));
}

}  // namespace

uint64_t units_before(const Digest& atlas, uint32_t pass) {
  constexpr uint32_t kLayoutBits = 19, kUnitBits = 32;  // 52 bits with the pass: exact in a double
  uint64_t layout = 0;
  std::memcpy(&layout, atlas.bytes.data(), sizeof layout);
  return (uint64_t{pass} << kLayoutBits | layout >> (64 - kLayoutBits)) << kUnitBits;
}

Expected<std::vector<ChartLight>> lay_out_by_light(const TwoPassTask& task, Preflight& pre) {
  const BakeSettings& settings = task.request.settings;
  if (!settings.two_pass || !pre.atlas.packed) return std::vector<ChartLight>{};
  const auto leave_out = [&] {
    pre.imported.notes.push_back({ImportNote::Kind::kIgnored,
                                  "the first pass of --two-pass was left out, and no chart was collapsed by "
                                  "its light: the time limit left no time for two passes"});
    return std::vector<ChartLight>{};
  };
  const double seconds = seconds_for_first_pass(task, pre);
  if (!(seconds > 0)) return leave_out();
  FirstPass pass;
  {
    const StageTimer timer(task.report.stages, "first pass");
    task.progress({.stage = "first pass"});
    KILN_TRY(pass, bake_first_pass(task, pre, seconds));
  }
  if (!pass.complete) return leave_out();
  task.report.two_pass.samples = kReplicates * kFirstPassSamples;
  task.report.two_pass.rays = pass.farm.rays;
  task.report.two_pass.worker_seconds = pass.farm.worker_seconds;

  KILN_TRY(const std::vector<ChartLight> light, judge(pass, pre.atlas, settings));
  if (std::none_of(light.begin(), light.end(), [](const ChartLight& c) { return c.why != kNotCollapsed; })) {
    pre.imported.notes.push_back({ImportNote::Kind::kNote, two_pass_text(pre.atlas.statistics)});
    return std::vector<ChartLight>{};
  }
  std::vector<uint8_t> reasons = pre.atlas.collapsed;  // unseen charts stay collapsed
  reasons.resize(light.size(), kNotCollapsed);
  for (size_t p = 0; p < light.size(); ++p)
    if (reasons[p] == kNotCollapsed) reasons[p] = light[p].why;
  const Atlas first = std::move(pre.atlas);
  LayoutWish wish;
  wish.collapse = [&](const ChartsToSize& charts) { return collapse_of(charts, first, reasons); };
  KILN_TRY_STATUS(lay_out_again(task.request.scene, settings, wish, pre, task.report.stages, task.progress,
                                task.may_go_on));
  pre.imported.notes.push_back({ImportNote::Kind::kNote, two_pass_text(pre.atlas.statistics)});
  std::vector<ChartLight> out;
  for (const uint32_t from : same_charts(first, pre.atlas))
    out.push_back(from == kNoChart ? ChartLight{} : light[from]);
  return out;
}

void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, TexelErrors& errors) {
  if (light.empty()) return;
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    const uint32_t owner = atlas.owner[atlas.sites.texel[site]];
    if (owner && atlas.collapsed[owner - 1] == kEvenlyLit)
      errors.standard_error[site] = std::hypot(errors.standard_error[site], light[owner - 1].deviation[0]);
  }
}

void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, const BasisInfo& basis,
                      Lightmap& map) {
  if (light.empty()) return;
  const std::vector<BasisBand> bands = basis_bands(basis);
  for (const uint32_t texel : atlas.sites.texel) {
    const uint32_t owner = atlas.owner[texel];
    if (!owner || atlas.collapsed[owner - 1] != kEvenlyLit) continue;
    const std::vector<float>& deviation = light[owner - 1].deviation;
    const auto add = [&](std::vector<float>& plane, float d) { plane[texel] = std::hypot(plane[texel], d); };
    if (!map.measured.names.empty()) add(map.measured.plane("error"), deviation[0]);
    for (size_t b = 0; b < bands.size(); ++b) add(map.band_error.plane(bands[b].name), deviation[b + 1]);
  }
}

}  // namespace kiln

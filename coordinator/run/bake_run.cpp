#include "coordinator/run/bake_run.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/kept_memory.h"
#include "coordinator/bake/collapse/same_charts.h"
#include "coordinator/run/bake_stages.h"
#include "coordinator/run/output_folder.h"
#include "coordinator/run/probe_run.h"

namespace kiln {
namespace {

using Progress = std::function<void(const BakeProgress&)>;

Status check_cancelled(const BakeRequest& request) {
  if (request.cancelled && *request.cancelled) return fail(ErrorKind::kUnavailable, "the job was cancelled");
  return {};
}

// Checked during layout: whether to end the bake.
Status check_going_on(const BakeRequest& request, const Stopwatch& watch) {
  KILN_TRY_STATUS(check_cancelled(request));
  const double limit = request.settings.time_limit;
  // Early in a bake, ending saves little: a small map may still finish.
  if (limit <= 0 || watch.seconds() <= std::max(limit, 1.0)) return {};
  return fail(ErrorKind::kTooShort,
              text("{}: --time-limit {} is too short: import and layout alone take longer; nothing was "
                   "published. Give it more time, or a lower --texels-per-metre",
                   request.scene.string(), limit));
}

// A map with charts that were never sampled is not published.
tl::unexpected<Error> too_short(const BakeRequest& request, const Preflight& pre, const TimeBudget& budget,
                                const Stopwatch& watch) {
  return fail(
      ErrorKind::kTooShort,
      text("{}: --time-limit {} is too short: import, atlas and start took {:.1f} s and what comes after the "
           "passes would take {:.1f} s, so that not every chart of the {} texels could be sampled; nothing "
           "was "
           "published. Give it more time, or a lower --texels-per-metre",
           request.scene.string(), request.settings.time_limit, watch.seconds(), budget.seconds_after(),
           pre.atlas.sites.size()));
}

// Fills in everything known before the first pass.
void begin_report(const Preflight& pre, BakeReport& report) {
  report.notes = pre.imported.notes;
  report.warnings.insert(report.warnings.end(), pre.plan.warnings.begin(), pre.plan.warnings.end());
  report.warnings.insert(report.warnings.end(), pre.atlas.warnings.begin(), pre.atlas.warnings.end());
  report.atlas = pre.atlas.statistics;
  report.plan = pre.plan;
  report.settings.min_samples = pre.plan.least_samples;
  report.lods = pre.projection.fits;
  report.kept_layout = pre.kept_layout;
  for (const CollapseReason why : {kUnseen, kUnlit, kEvenlyLit})
    report.two_pass.collapsed[why] = list_charts(pre.atlas.collapsed, why);
}

// Runs the passes on a farm and closes it: workers end before the map is completed.
Expected<Baked> run_passes(const BakeRun& run, Workplace& workplace, const JobSpec& job,
                           const ChunkStore& chunks, const SurfaceGraph* surface, Accumulator& sums) {
  std::vector<uint8_t> misleading = misleading_sites(run, surface);
  const StageTimer timer(run.report.stages, "bake");
  KILN_TRY(FarmJob* const farm, workplace.open(job, chunks));
  BakingTask task{run.request, run.preflight, surface, run.budget, *farm, sums, run.report, run.progress};
  if (run.request.settings.two_pass) {
    task.passes_before = kFirstPassSteps;
    task.units_before = units_before(job.atlas, 1);
  }
  task.misleading = std::move(misleading);
  KILN_TRY(Baked baked, bake_passes(task));
  run.report.farm = farm->statistics();
  workplace.close();
  return baked;
}

// Reserves time for the denoiser; warns if there is none.
bool plan_denoiser(const BakeSettings& settings, TimeBudget& budget, BakeReport& report) {
  const bool denoises = budget.take_time_for_denoiser();
  if (settings.denoise && settings.quantities.light && !denoises)
    report.warnings.push_back(
        "the map was not denoised: the time limit left no time for it; give it more, or a lower "
        "--texels-per-metre");
  return denoises;
}

// A bake without a lightmap has no layout, no passes over texels and no textures.
Expected<BakeReport> bake_probes_alone(const BakeRequest& request, const Preflight& pre,
                                       const Stopwatch& watch, const Progress& progress, BakeReport& report) {
  if (!pre.probes)
    return fail(ErrorKind::kUsage,
                text("{}: --quantities {} asks for neither a lightmap nor probes", request.scene.string(),
                     print_quantities(request.settings.quantities)));
  KILN_TRY_STATUS(prepare_output_folder(request.output, pre.probes->size() * probe_bytes(true)));
  report.notes = pre.imported.notes;
  Workplace workplace(request);
  const ProbeTask task{request, pre, workplace, watch, report, progress};
  KILN_TRY(const BakedProbes probes, bake_probes(task));
  KILN_TRY_STATUS(check_cancelled(request));
  report.complete = report.probes.complete;
  KILN_TRY_STATUS(publish_probes(task, probes));
  return report;
}

}  // namespace

Expected<BakeReport> run_bake(const BakeRequest& request, const Progress& progress) {
  const Stopwatch watch;
  const KeptMemory memory;
  BakeReport report;
  report.scene_path = request.scene;
  report.settings = request.settings;
  KILN_TRY_STATUS(check_output_folder(request.output));
  const auto may_go_on = [&] { return check_going_on(request, watch); };
  KILN_TRY(Preflight pre, run_preflight(request.scene, request.settings, report.stages, progress, may_go_on));
  if (!wants_lightmap(request.settings)) return bake_probes_alone(request, pre, watch, progress, report);
  {
    TimeBudget first(request, pre, watch);
    first.take_time_for_denoiser();
    if (first.is_hopeless()) return too_short(request, pre, first, watch);
  }
  KILN_TRY_STATUS(prepare_output_folder(request.output, pre.plan.output_bytes));
  Workplace workplace(request);
  KILN_TRY(const std::vector<ChartLight> light,
           lay_out_by_light({request, workplace, watch, report, progress, may_go_on}, pre));
  TimeBudget budget(request, pre, watch);
  const bool denoises = plan_denoiser(request.settings, budget, report);
  begin_report(pre, report);
  KILN_TRY_STATUS(check_cancelled(request));

  std::optional<BakedProbes> probes;
  if (pre.probes) {
    KILN_TRY(probes, bake_probes({request, pre, workplace, watch, report, progress}));
  }
  KILN_TRY_STATUS(check_cancelled(request));
  ChunkStore chunks;
  KILN_TRY(const JobSpec job, make_job(pre, request.settings, chunks));
  report.scene_id = job.scene.hex();
  SeamFinder seams(pre.imported.scene, pre.atlas);
  const BakeRun run{request, watch, progress, report, pre, budget, seams, probes ? &*probes : nullptr};
  const std::optional<SurfaceGraph> surface = denoises ? std::optional(find_surface(run)) : std::nullopt;
  Accumulator sums(pre.atlas.sites.size(), MomentLayout(job.transport.basis, job.transport.quantities));
  KILN_TRY(Baked baked, run_passes(run, workplace, job, chunks, surface ? &*surface : nullptr, sums));
  if (!baked.whole) return too_short(request, pre, budget, watch);
  KILN_TRY_STATUS(check_cancelled(request));

  Lightmap map = resolve_map(run, sums, surface ? &*surface : nullptr, light, baked);
  const bool joined = complete_map(run, map);
  KILN_TRY_STATUS(publish_map(run, map, joined));
  return report;
}

}  // namespace kiln

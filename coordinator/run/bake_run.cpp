#include "coordinator/run/bake_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/base/statistics.h"
#include "common/responses/basis.h"
#include "coordinator/bake/collapse/same_charts.h"
#include "coordinator/bake/denoise/coarse.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/neighbours/views.h"
#include "coordinator/bake/post/stage.h"
#include "coordinator/output/textures/textures.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/run/baking.h"
#include "coordinator/run/statement.h"
#include "coordinator/run/two_pass.h"

namespace kiln {
namespace {

using Progress = std::function<void(const BakeProgress&)>;

Status check_cancelled(const BakeRequest& request) {
  if (request.cancelled && *request.cancelled) return fail(ErrorKind::kUnavailable, "the job was cancelled");
  return {};
}

// While the layout is made: is there a reason to end the bake?
Status check_going_on(const BakeRequest& request, const Stopwatch& watch) {
  KILN_TRY_STATUS(check_cancelled(request));
  const double limit = request.settings.time_limit;
  // Where little time went by there is little to be saved by ending now: a small map may still be done.
  if (limit <= 0 || watch.seconds() <= std::max(limit, 1.0)) return {};
  return fail(ErrorKind::kTooShort,
              text("{}: --time-limit {} is too short: import and layout alone take longer; nothing was "
                   "published. Give it more time, or a lower --texels-per-metre",
                   request.scene.string(), limit));
}

// The error plane of the map: what is stated of each texel.
void state_errors(Lightmap& map, const Atlas& atlas, const TexelErrors& errors) {
  std::vector<float>& plane = map.planes.plane("error");
  for (uint32_t site = 0; site < errors.standard_error.size(); ++site)
    if (std::isfinite(errors.standard_error[site]))
      plane[atlas.sites.texel[site]] = errors.standard_error[site];
}

void state_band_errors(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics,
                       std::span<const uint32_t> charts, const BasisInfo& basis,
                       std::span<const float> lowered) {
  map.band_error.width = map.planes.width;
  map.band_error.height = map.planes.height;
  for (const BasisBand& band : basis_bands(basis)) {
    std::vector<size_t> planes;
    for (const size_t f : band.functions) planes.push_back(3 + 3 * f);
    const std::vector<float> errors = band_errors(statistics, charts, planes);
    std::vector<float>& plane = map.band_error.add(band.name);
    for (size_t site = 0; site < errors.size(); ++site)
      plane[atlas.sites.texel[site]] = errors[site] * (lowered.empty() ? 1.0f : lowered[site]);
  }
}

// Puts the filtered planes in the place of the measured ones, and what is stated of them. Returns by how much
// errors became less, by site.
std::vector<float> take_denoised(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics,
                                 const SurfaceGraph& surface, uint32_t levels, TexelErrors& errors) {
  map.measured = map.planes;
  const auto drop = static_cast<ptrdiff_t>(map.planes.names.size() - 1);  // samples, which have a file
  map.measured.names.erase(map.measured.names.begin() + drop);
  map.measured.data.erase(map.measured.data.begin() + drop);
  const Denoised d = denoise_joined(statistics, map.bounds, surface.sites, surface.links, levels, 0);
  std::vector<float> lowered(statistics.sites, 1.0f);
  for_each_index(statistics.sites, 0, [&](size_t site) {
    if (d.filled[site]) map.validity[atlas.sites.texel[site]] = Validity::kFilled;
    if (!statistics.known[site] && !d.filled[site]) return;
    if (d.raw_error[site] > 0 && std::isfinite(d.raw_error[site]))
      lowered[site] = d.standard_error[site] / d.raw_error[site];
    for (size_t p = 0; p < statistics.planes; ++p)
      map.planes.data[p][atlas.sites.texel[site]] = d.mean[site * statistics.planes + p];
    map.measured.plane("error")[atlas.sites.texel[site]] = d.raw_error[site];
    errors.mean[site] = d.luminance[site];
    errors.standard_error[site] = d.standard_error[site];
  });
  return lowered;
}

// A map of which some charts are only guessed is no map.
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

void count_classes(const Lightmap& map, const Atlas& atlas, BakeReport& report) {
  for (Validity v : map.validity) ++report.texels_by_class[static_cast<int>(v)];
  for (uint32_t owner : atlas.owner) report.owned_texels += owner != 0;
  report.layout = atlas.packed ? "pack" : "atlas";
  report.width = atlas.width;
  report.height = atlas.height;
  report.pages = atlas.pages;
  report.charts = atlas.placements.size();
}

// What is known of a bake before its first pass.
void begin_report(const Preflight& pre, BakeReport& report) {
  report.notes = pre.imported.notes;
  report.warnings.insert(report.warnings.end(), pre.plan.warnings.begin(), pre.plan.warnings.end());
  report.warnings.insert(report.warnings.end(), pre.atlas.warnings.begin(), pre.atlas.warnings.end());
  report.atlas = pre.atlas.statistics;
  report.plan = pre.plan;
  report.lods = pre.projection.fits;
  report.kept_layout = pre.kept_layout;
  for (const CollapseReason why : {kUnseen, kUnlit, kEvenlyLit})
    report.two_pass.collapsed[why] = list_charts(pre.atlas.collapsed, why);
}

// The settings' pictures, or smaller ones where time is short, or none; what is not as asked for is said.
BakeSettings picture_settings(const BakeRequest& request, const TimeBudget& budget, BakeReport& report) {
  BakeSettings settings = request.settings;
  if (!settings.preview) return settings;
  const double scale = budget.picture_scale();
  if (scale < 1) {
    settings.preview = scale > 0;
    settings.preview_width = std::max(1u, static_cast<uint32_t>(scale * settings.preview_width));
    settings.preview_height = std::max(1u, static_cast<uint32_t>(scale * settings.preview_height));
    report.notes.push_back({ImportNote::Kind::kIgnored,
                            settings.preview
                                ? text("the pictures are {} x {} pixels: the time limit left no more time",
                                       settings.preview_width, settings.preview_height)
                                : "there are no pictures: the time limit left no time for them"});
  }
  return settings;
}

// `seams`: they are joined, so that textures keep both sides equal.
Status publish(const BakeRequest& request, const Preflight& pre, const Lightmap& map, bool seams,
               SeamFinder& finder, BakeReport& report, const TimeBudget& budget, const Stopwatch& watch) {
  ReportPictures pictures;
  TextureResult textures;
  {
    const StageTimer timer(report.stages, "textures");
    BakeSettings settings = request.settings;
    settings.seams = seams;
    if (budget.is_quick()) {
      settings.encode_effort = "fast";
      report.notes.push_back({ImportNote::Kind::kIgnored,
                              "textures are encoded by --encode-effort fast, their error is measured on a "
                              "quarter of their blocks, and masters are written without compression: the "
                              "time limit left no more time"});
    }
    KILN_TRY(textures, make_textures({pre.imported.scene, pre.atlas, map, settings, request.output,
                                      budget.is_quick() ? 4u : 1u, &finder}));
    report.textures = textures.figures;
    report.unmet = beyond_bound(textures, request.settings);
  }
  {
    const StageTimer timer(report.stages, "encode");
    KILN_TRY(report.outputs,
             write_outputs({request.settings, pre.imported.scene, pre.atlas, pre.imported.document, map,
                            request.output, &pre.imported.display, &pre.projection, &textures.list,
                            &textures.files, !budget.is_quick()}));
  }
  if (request.pictures) {
    const StageTimer timer(report.stages, "preview");
    KILN_TRY(pictures, write_pictures(request.output, pre.imported, pre.atlas, map,
                                      picture_settings(request, budget, report)));
  }
  report.total_seconds = watch.seconds();
  if (request.pictures) {
    KILN_TRY(const std::string page, report_html(report, map, pictures, textures.error_pictures));
    KILN_TRY_STATUS(write_file_atomic(request.output / "report.html", page));
  }
  return write_file_atomic(request.output / "report.json", report_json(report));
}

}  // namespace

Expected<BakeReport> run_bake(const BakeRequest& request, const Progress& progress) {
  const Stopwatch watch;
  BakeReport report;
  report.scene_path = request.scene;
  report.settings = request.settings;
  const auto may_go_on = [&] { return check_going_on(request, watch); };
  KILN_TRY(Preflight pre, run_preflight(request.scene, request.settings, report.stages, progress, may_go_on));
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
  const bool denoises = budget.take_time_for_denoiser();
  if (request.settings.denoise && !denoises)
    report.warnings.push_back(
        "the map was not denoised: the time limit left no time for it; give it more, or a lower "
        "--texels-per-metre");
  begin_report(pre, report);

  KILN_TRY_STATUS(check_cancelled(request));
  ChunkStore chunks;
  KILN_TRY(const JobSpec job, make_job(pre, request.settings, chunks));
  report.scene_id = job.scene.hex();

  Accumulator sums(pre.atlas.sites.size(), job.transport.basis);
  Baked baked;
  SeamFinder seams(pre.imported.scene, pre.atlas);
  std::optional<SurfaceGraph> surface;
  if (denoises) {
    const StageTimer timer(report.stages, "neighbours");
    surface.emplace();
    surface->sites = site_geometry(pre.imported.scene, pre.atlas, 0);
    surface->links = surface_links(seams, surface->sites, 0);
    budget.seams_are(seams.find().points.size());
    const double large = share_of_large_pieces(surface->links);
    budget.surface_is(large);
    report.post.push_back({"texels on large surfaces", 100 * large, "%"});
    if (const auto seen =
            link_by_view(pre.imported.scene, surface->sites, 0, budget.views_seconds(), surface->links)) {
      report.post.push_back({"neighbours that see other things", static_cast<double>(seen->parted), "pairs"});
      report.post.push_back({"small pieces that see the same", static_cast<double>(seen->added), "pairs"});
    } else {
      report.notes.push_back({ImportNote::Kind::kIgnored,
                              "texels are denoised without asking what each sees: the time limit left no "
                              "time for it; some light may be smeared under furniture"});
    }
  }
  {
    const StageTimer timer(report.stages, "bake");
    KILN_TRY(FarmJob* const farm, workplace.open(job, chunks));
    BakingTask task{request, pre, surface ? &*surface : nullptr, budget, *farm, sums, report, progress};
    if (request.settings.two_pass) {
      task.passes_before = kFirstPassSteps;
      task.units_before = units_before(job.atlas, 1);
    }
    KILN_TRY(baked, bake_passes(task));
    report.farm = farm->statistics();
    workplace.close();
  }
  if (!baked.whole) return too_short(request, pre, budget, watch);
  KILN_TRY_STATUS(check_cancelled(request));
  Lightmap map = sums.resolve(pre.atlas);
  check_dark(map, pre.atlas, report);
  {
    const StageTimer timer(report.stages, surface ? "denoise" : "errors");
    progress({.stage = surface ? "denoise" : "errors"});
    const TexelStatistics statistics = sums.statistics();
    std::vector<float> lowered;
    if (surface) {
      const uint32_t levels = std::max(denoise_levels(statistics), budget.denoise_levels());
      lowered = take_denoised(map, pre.atlas, statistics, *surface, levels, baked.errors);
    }
    const BasisInfo& basis = basis_roster()[job.transport.basis];
    state_deviations(pre.atlas, light, baked.errors);
    state_errors(map, pre.atlas, baked.errors);
    const std::vector<uint32_t> charts = charts_of_sites(pre.atlas);
    state_band_errors(map, pre.atlas, statistics, charts, basis, lowered);
    state_deviations(pre.atlas, light, basis, map);
    report.statement = state_map(baked.errors, statistics, request.settings.error,
                                 normal_interval(request.settings.confidence));
    warn_of_few_samples(statistics, charts, report);
    if (surface) warn_of_rough_cache(baked.errors, baked.first_cache_error, report);
  }
  const bool joins_seams = request.settings.seams && budget.has_time_for_seams();
  for (const PostStage& stage : post_stages()) {
    if (stage.name == "seams" && request.settings.seams && !joins_seams) {
      report.warnings.push_back(
          "seams between charts were not joined: the time limit left no time for it; give it more");
      continue;
    }
    const StageTimer timer(report.stages, std::string(stage.name));
    progress({.stage = std::string(stage.name)});
    for (Figure& figure : stage.run(map, {pre.imported.scene, pre.atlas, request.settings, &seams}))
      report.post.push_back(std::move(figure));
  }
  count_classes(map, pre.atlas, report);
  progress({.stage = "publish"});
  KILN_TRY_STATUS(publish(request, pre, map, joins_seams, seams, report, budget, watch));
  return report;
}

}  // namespace kiln

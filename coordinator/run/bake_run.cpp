#include "coordinator/run/bake_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/basis/basis.h"
#include "common/math/samplers.h"
#include "common/scene/prepared.h"
#include "coordinator/merge/accumulator.h"
#include "coordinator/post/stage.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/run/baking.h"
#include "coordinator/textures/textures.h"

namespace kiln {
namespace {

using Progress = std::function<void(const BakeProgress&)>;

FarmSettings farm_settings(const BakeRequest& request) {
  const BakeSettings& s = request.settings;
  FarmSettings f;
  f.token = random_hex(16);
  f.local_workers = s.workers ? s.workers : 1;
  f.local_threads = s.threads ? s.threads : std::max(1u, hardware_threads() / f.local_workers);
  f.worker_program = request.worker_program.string();
  f.rules.lease_ms = s.lease_ms;
  return f;
}

// A farm of its own, if no other is given.
struct Workplace {
  std::unique_ptr<Farm> farm;
  std::unique_ptr<FarmJob> job;  // ends before its farm
};

Expected<Workplace> open_workplace(const BakeRequest& request, const JobSpec& spec,
                                   const ChunkStore& chunks) {
  Workplace place;
  if (request.open_job) {
    KILN_TRY(place.job, request.open_job(spec, chunks));
    return place;
  }
  KILN_TRY(place.farm, Farm::start(farm_settings(request)));
  JobTraits traits;
  traits.quorum = request.quorum;
  KILN_TRY(place.job, place.farm->open_job({spec, &chunks, traits, {}}));
  return place;
}

Status check_cancelled(const BakeRequest& request) {
  if (request.cancelled && *request.cancelled) return fail(ErrorKind::kUnavailable, "the job was cancelled");
  return {};
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

// Texels of which the stated error is not to be relied on.
void state_doubts(const TexelStatistics& statistics, std::span<const uint32_t> charts, BakeReport& report) {
  const std::vector<float> samples = effective_samples(statistics, charts);
  const auto few =
      std::count_if(samples.begin(), samples.end(), [](float n) { return n > 0 && n < kFewSamples; });
  report.post.push_back({"texels of few bright samples", static_cast<double>(few), "texels"});
  uint64_t black = 0;
  for (size_t i = 0; i < statistics.sites; ++i)
    black += statistics.known[i] && statistics.luminance[0][i] == 0 && statistics.luminance[1][i] == 0;
  report.post.push_back({"texels that met no light", static_cast<double>(black), "texels"});
  if (few > 0)
    report.warnings.push_back(
        text("{} texels have their light from fewer than {:.0f} bright samples, those around them included: "
             "it may be "
             "further off than error.exr says. More samples (--min-samples) tell",
             few, kFewSamples));
}

// Filtering takes away what texels are wrong by themselves; what they took from the cache stays. The passes
// after the first cache take a part of its error away. Chosen on the bench scenes: most texels of rooms lit
// by a slit are beyond this, few of the others.
constexpr double kRefined = 0.5;

void state_shared_doubts(const Baked& baked, BakeReport& report) {
  if (baked.first_cache_error.empty()) return;
  const TexelErrors& e = baked.errors;
  uint64_t doubtful = 0;
  for (size_t i = 0; i < e.mean.size(); ++i)
    doubtful += std::isfinite(e.standard_error[i]) &&
                e.standard_error[i] < kRefined * baked.first_cache_error[i] * e.mean[i];
  report.post.push_back({"texels of a rough first cache", static_cast<double>(doubtful), "texels"});
  if (doubtful > 0)
    report.warnings.push_back(text(
        "{} texels have their light by way of texels that whole paths hardly found: what they are all wrong "
        "by alike may be more than error.exr says. --denoise off or --cache off tell more surely",
        doubtful));
}

// What stages after the passes are taken to need: an allowance by the size of the map (docs/samples.md,
// "Allocation").
double seconds_after_passes(const BakeRequest& request, const Preflight& pre) {
  const BakeSettings& s = request.settings;
  // The report's pictures, whose size is fixed; then seconds of one thread for each texel.
  const double pictures = request.pictures ? 2.0 : 0;
  double texel_seconds = 2e-6;
  if (s.denoise) texel_seconds += 8e-6;
  if (s.seams) texel_seconds += 3e-6;
  for (const std::string& encoding : s.encodings)
    if (encoding != "none") texel_seconds += 4e-6;
  return pictures + texel_seconds * static_cast<double>(pre.atlas.sites.size()) / hardware_threads();
}

// What is left of the time limit when stages before and after the passes have theirs.
double seconds_for_passes(const BakeRequest& request, double after, const Stopwatch& watch) {
  const double limit = request.settings.time_limit;
  if (limit <= 0) return std::numeric_limits<double>::infinity();
  return std::max(0.0, limit - watch.seconds() - after);
}

// Puts the filtered planes in the place of the measured ones, and what is stated of them. Returns by how much
// errors became less, by site.
std::vector<float> take_denoised(Lightmap& map, const Atlas& atlas, const TexelStatistics& statistics,
                                 const SurfaceGraph& surface, TexelErrors& errors) {
  map.measured = map.planes;
  const auto drop = static_cast<ptrdiff_t>(map.planes.names.size() - 1);  // samples, which have a file
  map.measured.names.erase(map.measured.names.begin() + drop);
  map.measured.data.erase(map.measured.data.begin() + drop);
  const Denoised d = denoise(statistics, map.bounds, surface.sites, surface.links, 0);
  std::vector<float> lowered(statistics.sites, 1.0f);
  for (uint32_t site = 0; site < statistics.sites; ++site) {
    if (!statistics.known[site]) continue;
    if (d.raw_error[site] > 0 && std::isfinite(d.raw_error[site]))
      lowered[site] = d.standard_error[site] / d.raw_error[site];
    for (size_t p = 0; p < statistics.planes; ++p)
      map.planes.data[p][atlas.sites.texel[site]] = d.mean[site * statistics.planes + p];
    map.measured.plane("error")[atlas.sites.texel[site]] = d.raw_error[site];
    errors.mean[site] = d.luminance[site];
    errors.standard_error[site] = d.standard_error[site];
  }
  return lowered;
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

Status publish(const BakeRequest& request, const Preflight& pre, const Lightmap& map, BakeReport& report,
               const Stopwatch& watch) {
  ReportPictures pictures;
  TextureResult textures;
  {
    const StageTimer timer(report.stages, "textures");
    KILN_TRY(textures, make_textures({pre.imported.scene, pre.atlas, map, request.settings, request.output}));
    report.textures = textures.figures;
    report.unmet = beyond_bound(textures, request.settings);
  }
  {
    const StageTimer timer(report.stages, "encode");
    KILN_TRY(report.outputs, write_outputs({request.settings, pre.imported.scene, pre.atlas,
                                            pre.imported.document, map, request.output, &pre.imported.display,
                                            &pre.projection, &textures.list, &textures.files}));
  }
  if (request.pictures) {
    const StageTimer timer(report.stages, "preview");
    KILN_TRY(pictures, write_pictures(request.output, pre.imported, pre.atlas, map, request.settings));
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
  KILN_TRY(Preflight pre, run_preflight(request.scene, request.settings, report.stages, progress));
  KILN_TRY_STATUS(prepare_output_folder(request.output, pre.plan.output_bytes));
  report.notes = pre.imported.notes;
  report.warnings = pre.plan.warnings;
  report.warnings.insert(report.warnings.end(), pre.atlas.warnings.begin(), pre.atlas.warnings.end());
  report.atlas = pre.atlas.statistics;
  report.plan = pre.plan;
  report.lods = pre.projection.fits;
  report.kept_layout = pre.kept_layout;

  KILN_TRY_STATUS(check_cancelled(request));
  ChunkStore chunks;
  JobSpec job;
  job.id = 1;
  job.scene = write_scene(pre.imported.scene, chunks);
  job.atlas = chunks.add(write_atlas(pre.atlas));
  KILN_TRY(job.transport.basis, find_basis(request.settings.basis));
  job.transport.direct = request.settings.direct;
  job.transport.indirect = request.settings.indirect;
  job.transport.max_bounces = request.settings.max_bounces;
  job.transport.seed = request.settings.seed;
  KILN_TRY(job.transport.sampler, find_sampler(request.settings.sampler));
  job.transport.watertight = request.settings.watertight;
  job.transport.isa = request.settings.isa;
  report.scene_id = job.scene.hex();

  Accumulator sums(pre.atlas.sites.size(), job.transport.basis);
  Baked baked;
  std::optional<SurfaceGraph> surface;
  if (request.settings.denoise) {
    const StageTimer timer(report.stages, "neighbours");
    surface.emplace();
    surface->sites = site_geometry(pre.imported.scene, pre.atlas, 0);
    surface->links = surface_links(pre.imported.scene, pre.atlas, surface->sites, 0);
  }
  {
    const StageTimer timer(report.stages, "bake");
    KILN_TRY(const Workplace place, open_workplace(request, job, chunks));
    const double after = seconds_after_passes(request, pre);
    KILN_TRY(baked, bake_passes({request, pre, surface ? &*surface : nullptr,
                                 seconds_for_passes(request, after, watch), after, *place.job, sums, report,
                                 progress}));
    report.farm = place.job->statistics();
  }
  KILN_TRY_STATUS(check_cancelled(request));
  Lightmap map = sums.resolve(pre.atlas);
  {
    const StageTimer timer(report.stages, surface ? "denoise" : "errors");
    progress({.stage = surface ? "denoise" : "errors"});
    const TexelStatistics statistics = sums.statistics();
    std::vector<float> lowered;
    if (surface) lowered = take_denoised(map, pre.atlas, statistics, *surface, baked.errors);
    state_errors(map, pre.atlas, baked.errors);
    const std::vector<uint32_t> charts = charts_of_sites(pre.atlas);
    state_band_errors(map, pre.atlas, statistics, charts, basis_roster()[job.transport.basis], lowered);
    state_doubts(statistics, charts, report);
    if (surface) state_shared_doubts(baked, report);
  }
  for (const PostStage& stage : post_stages()) {
    const StageTimer timer(report.stages, std::string(stage.name));
    progress({.stage = std::string(stage.name)});
    for (Figure& figure : stage.run(map, {pre.imported.scene, pre.atlas, request.settings}))
      report.post.push_back(std::move(figure));
  }
  count_classes(map, pre.atlas, report);
  progress({.stage = "publish"});
  KILN_TRY_STATUS(publish(request, pre, map, report, watch));
  return report;
}

}  // namespace kiln

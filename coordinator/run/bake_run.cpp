#include "coordinator/run/bake_run.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/base/statistics.h"
#include "common/basis/basis.h"
#include "common/math/samplers.h"
#include "common/scene/prepared.h"
#include "coordinator/merge/accumulator.h"
#include "coordinator/plan/schedule.h"
#include "coordinator/post/stage.h"
#include "coordinator/report/density_view.h"
#include "coordinator/report/preview.h"
#include "coordinator/report/validity_view.h"
#include "coordinator/run/nonfinite.h"
#include "coordinator/textures/textures.h"

namespace kiln {
namespace {

using Progress = std::function<void(const BakeProgress&)>;

constexpr double kUnitSeconds = 1;     // of a thread: long beside a message, short beside a lost machine
constexpr double kUnitsPerThread = 8;  // at least, of a pass: so that its end is not one thread's

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

PassPoint measure(const Accumulator& sums, size_t sites, double error, double z) {
  PassPoint point;
  double squares = 0;
  uint64_t lit = 0, measured = 0, converged = 0;
  for (uint32_t site = 0; site < sites; ++site) {
    const Accumulator::Estimate e = sums.estimate(site);
    if (e.inside || sums.samples(site) == 0) continue;
    ++measured;
    converged += sums.converged(site, error, z);
    if (!(e.mean > 0) || !std::isfinite(e.standard_error)) continue;
    const double relative = e.standard_error / e.mean;
    squares += relative * relative;
    point.worst_relative = std::max(point.worst_relative, relative);
    ++lit;
  }
  point.rms_relative = lit ? std::sqrt(squares / static_cast<double>(lit)) : 0;
  point.converged_share = measured ? static_cast<double>(converged) / static_cast<double>(measured) : 0;
  return point;
}

// Runs pass after pass until every texel has converged, has its most samples, or time is up.
class Baking {
 public:
  Baking(const BakeRequest& request, const Preflight& pre, FarmJob& farm, Accumulator& sums,
         BakeReport& report, const Progress& progress)
      : request_(request),
        settings_(request.settings),
        farm_(farm),
        sums_(sums),
        report_(report),
        progress_(progress),
        site_count_(pre.atlas.sites.size()),
        nonfinite_(pre.atlas, pre.imported.scene),
        z_(normal_interval(settings_.confidence)) {}

  Status run() {
    const int64_t deadline =
        settings_.time_limit > 0 ? clock_.now_ms() + static_cast<int64_t>(settings_.time_limit * 1000) : 0;
    for (;;) {
      KILN_TRY(const PassEnd end, run_passes(deadline));
      if (end != PassEnd::kRewound) break;
      sums_.clear();
      report_.passes.clear();
      nonfinite_.clear();
      next_unit_ = 1;
    }
    report_.nonfinite = nonfinite_.places();
    if (const std::string s = nonfinite_.sentence(); !s.empty()) report_.warnings.push_back(s);
    if (!skipped_.empty())
      report_.warnings.push_back(
          text("{} units failed on every worker that tried them and were left out; their {} "
               "texels have fewer samples or none: {}",
               skipped_units_, skipped_.size(), skip_reason_));
    return {};
  }

 private:
  Expected<PassEnd> run_passes(int64_t deadline) {
    active_.clear();
    skipped_.clear();
    skipped_units_ = 0;
    for (uint32_t i = 0; i < site_count_; ++i) active_.push_back(i);
    const auto passes = sample_passes(settings_.min_samples, settings_.max_samples);
    for (uint32_t p = 0; p < passes.size() && !active_.empty(); ++p) {
      KILN_TRY(const PassEnd end, run_pass(passes[p], p, static_cast<uint32_t>(passes.size()), deadline));
      if (end == PassEnd::kRewound) return end;
      record(passes[p]);
      if (end == PassEnd::kTimeUp) {
        report_.complete = false;
        return end;
      }
      drop_converged();
      later_work_ = p + 2 < passes.size() ? work_after(passes, p + 1) : 0;
    }
    return PassEnd::kComplete;
  }

  Expected<PassEnd> run_pass(SampleRange pass, uint32_t index, uint32_t count, int64_t deadline) {
    // A pass that is run again after a rewind is cut as before: its units are known by their numbers.
    if (index == cuts_.size()) {
      uint32_t chosen = unit_texels(pass);
      if (request_.cut) {
        KILN_TRY(chosen, request_.cut(index, chosen));
      }
      cuts_.push_back(chosen);
    }
    const uint32_t texels = cuts_[index];
    std::vector<WorkUnit> units = cut_pass(active_, pass, texels, next_unit_);
    order_by_gain(units);
    unit_texels_ = texels;
    const double before = watch_.seconds();
    const FarmStatistics earlier = farm_.statistics();
    PassHandlers handlers;
    handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) {
      nonfinite_.add(unit, result);
      return sums_.add(unit, result);
    };
    handlers.on_skipped = [&](const WorkUnit& unit, const std::string& reason) {
      ++skipped_units_;
      skip_reason_ = reason;
      skipped_.insert(unit.sites.begin(), unit.sites.end());
    };
    handlers.on_progress = [&](const FarmProgress& f) {
      BakeProgress b;
      b.stage = "bake";
      b.pass = index + 1;
      b.passes = count;
      b.done = f.weight > 0 ? f.weight_done / f.weight : 0;
      b.rays = f.rays;
      const double seconds = watch_.seconds();
      b.rays_per_second = seconds > 0 ? static_cast<double>(f.rays) / seconds : 0;
      b.workers = f.workers;
      threads_ = std::max(threads_, f.threads);
      b.converged_share = report_.passes.empty() ? 0 : report_.passes.back().converged_share;
      // At the speed of this pass; later passes are foretold from the variance that is known.
      if (b.done > 0.02)
        b.seconds_left = (seconds - before) * (f.weight - f.weight_done + later_work_) / f.weight_done;
      progress_(b);
    };
    KILN_TRY(const PassEnd end, farm_.run_pass(std::move(units), deadline, handlers));
    const FarmStatistics later = farm_.statistics();
    if (later.units > earlier.units)
      unit_seconds_ =
          (later.worker_seconds - earlier.worker_seconds) / static_cast<double>(later.units - earlier.units);
    return end;
  }

  // Samples that the active texels will need after pass `next`: the error of n samples falls as 1 / sqrt(n),
  // and a texel leaves at the end of a pass.
  double work_after(const std::vector<SampleRange>& passes, size_t next) const {
    double work = 0;
    for (const uint32_t site : active_) {
      const Accumulator::Estimate e = sums_.estimate(site);
      if (!(e.mean > 0) || !std::isfinite(e.standard_error)) continue;
      const double ratio = z_ * e.standard_error / (settings_.error * e.mean);
      const double needed = sums_.samples(site) * ratio * ratio;
      for (size_t p = next + 1; p < passes.size() && needed > passes[p].first; ++p) work += passes[p].count;
    }
    return work;
  }

  // How large units of the pass should be: by the speed that the last pass showed about a second of a
  // thread's time, less where that would leave threads without work at the end. The cut changes no byte.
  uint32_t unit_texels(SampleRange pass) const {
    if (unit_seconds_ <= 0) return settings_.tile_texels;
    const double texel_seconds = unit_seconds_ / unit_texels_;  // a unit is texels x 256 samples
    const double work = texel_seconds * static_cast<double>(active_.size()) * pass.count / 256;
    const double seconds = std::clamp(work / (kUnitsPerThread * std::max(1u, threads_)), 0.02, kUnitSeconds);
    const double texels = std::clamp(seconds / texel_seconds, unit_texels_ / 4.0, unit_texels_ * 4.0);
    return static_cast<uint32_t>(std::clamp(texels, 16.0, 8192.0));
  }

  // Units whose texels are farthest from what is asked for go first: a bake that is stopped by time has spent
  // it where the error was. Runs of texels stay whole, so neighbours stay together. The order changes no
  // byte.
  void order_by_gain(std::vector<WorkUnit>& units) const {
    std::vector<std::pair<double, size_t>> order;
    for (size_t i = 0; i < units.size(); ++i) {
      double gain = 0;
      for (const uint32_t site : units[i].sites) {
        const Accumulator::Estimate e = sums_.estimate(site);
        const double relative = e.mean > 0 && std::isfinite(e.standard_error) ? e.standard_error / e.mean : 0;
        gain += relative * relative;
      }
      // In steps of two: smaller differences are not worth jumping over the scene.
      order.emplace_back(
          gain > 0 ? -std::floor(std::log2(gain / static_cast<double>(units[i].sites.size()))) : 1e9, i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<WorkUnit> sorted;
    sorted.reserve(units.size());
    for (const auto& [key, i] : order) sorted.push_back(std::move(units[i]));
    units = std::move(sorted);
  }

  void record(SampleRange pass) {
    PassPoint point = measure(sums_, site_count_, settings_.error, z_);
    point.samples = pass.first + pass.count;
    point.active = active_.size();
    point.seconds = watch_.seconds();
    point.rays = farm_.statistics().rays;
    report_.passes.push_back(point);
  }

  // Decided at the barrier, from merged sums only: every run of the job decides alike.
  void drop_converged() {
    std::erase_if(active_, [&](uint32_t site) {
      return skipped_.count(site) || sums_.converged(site, settings_.error, z_);
    });
  }

  const BakeRequest& request_;
  const BakeSettings& settings_;
  FarmJob& farm_;
  Accumulator& sums_;
  BakeReport& report_;
  const Progress& progress_;
  const size_t site_count_;
  NonfiniteLog nonfinite_;
  const double z_;
  std::vector<uint32_t> active_;
  std::set<uint32_t> skipped_;  // sites of units that failed for good: no more samples
  uint64_t skipped_units_ = 0;
  std::string skip_reason_;
  std::vector<uint32_t> cuts_;  // texels of a unit, by pass
  uint32_t unit_texels_ = 0;    // of the last pass
  double unit_seconds_ = 0;
  uint32_t threads_ = 0;
  double later_work_ = 0;  // texels x samples of the passes after this one
  uint64_t next_unit_ = 1;
  SteadyClock clock_;
  Stopwatch watch_;
};

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
  const ReportPictures pictures{request.output / "preview.png", request.output / "validity.png"};
  Picture heat_map;
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
  {
    const StageTimer timer(report.stages, "preview");
    const Camera camera = preview_camera(pre.imported, pre.atlas, map);
    KILN_TRY_STATUS(write_preview(pictures.preview, pre.imported, pre.atlas, map, camera));
    KILN_TRY_STATUS(write_validity_view(pictures.validity, pre.imported, pre.atlas, map, camera));
    heat_map = density_view(pre.imported, pre.atlas, camera, 960, 540);
  }
  report.total_seconds = watch.seconds();
  KILN_TRY(const std::string page, report_html(report, map, pictures, heat_map, textures.error_pictures));
  KILN_TRY_STATUS(write_file_atomic(request.output / "report.html", page));
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
  {
    const StageTimer timer(report.stages, "bake");
    KILN_TRY(const Workplace place, open_workplace(request, job, chunks));
    KILN_TRY_STATUS(Baking(request, pre, *place.job, sums, report, progress).run());
    report.farm = place.job->statistics();
  }
  KILN_TRY_STATUS(check_cancelled(request));
  Lightmap map = sums.resolve(pre.atlas);
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

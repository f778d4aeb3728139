#include "coordinator/run/probe_run.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/base/statistics.h"
#include "common/probes/probe_points.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/probes/resolve.h"
#include "coordinator/bake/sampling/allocation.h"
#include "coordinator/bake/sampling/schedule.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/output/probes/published.h"
#include "coordinator/output/probes/shader_textures.h"
#include "coordinator/run/publish_folder.h"
#include "coordinator/run/two_pass.h"

namespace kiln {
namespace {

constexpr uint32_t kLeastSamples = 8;  // per replicate; from here on all counts are even
constexpr double kGrowth = 4;          // a probe's samples grow by at most this factor per pass
constexpr uint32_t kMaxPasses = 64;
constexpr uint32_t kTileProbes = 64;    // probes of 256 samples per unit
constexpr size_t kTogether = 16384;     // probes whose sums are held at a time, with visibility
constexpr uint32_t kUnitsOfProbes = 2;  // units_before(): apart from those of both passes of a map
constexpr double kTimeShare = 0.5;      // of a time limit

// Passes over a run of probes, to the error that is asked for or until time is up.
class ProbePasses {
 public:
  ProbePasses(const ProbeTask& task, const JobSpec& spec, FarmJob& farm, std::span<const uint32_t> volumes,
              int64_t deadline_ms)
      : task_(task),
        settings_(task.request.settings),
        farm_(farm),
        volumes_(volumes),
        deadline_ms_(deadline_ms),
        layout_(spec.transport.basis, spec.transport.quantities),
        z_(normal_interval(settings_.confidence)) {}

  // Sites [first, first + sums.sites()) of the job.
  Expected<PassEnd> run(uint32_t first, Accumulator& sums, uint64_t& next_unit) {
    KILN_TRY(const ErrorNorm norm, find_error_norm(settings_.error_norm));
    const uint32_t most = std::max(kLeastSamples, settings_.most_of_each() / kReplicates / 2 * 2);
    const uint32_t least =
        std::min(most, sample_count(std::max(kLeastSamples, (settings_.min_samples + 1) / kReplicates)));
    std::vector<SiteSamples> work;
    for (uint32_t i = 0; i < sums.sites(); ++i) work.push_back({first + i, {0, least}});
    for (uint32_t pass = 0; pass < kMaxPasses && !work.empty(); ++pass) {
      KILN_TRY(const PassEnd end, run_pass(work, first, sums, next_unit));
      errors_ = probe_errors(sums, volumes_.subspan(first, sums.sites()));
      if (end != PassEnd::kComplete) return end;
      const SampleState state{errors_.mean, errors_.irradiance, errors_.samples};
      const std::vector<double> needed = needed_samples(state, norm, settings_.error, z_);
      work.clear();
      for (uint32_t i = 0; i < needed.size(); ++i) {
        const uint32_t have = errors_.samples[i];
        if (!(needed[i] > have) || have == 0 || have >= most || skipped_.contains(first + i)) continue;
        const uint32_t to = std::min(sample_count(std::min(needed[i], kGrowth * have)), most);
        if (to > have) work.push_back({first + i, {have, to - have}});
      }
    }
    return PassEnd::kComplete;
  }

  const ProbeErrors& errors() const { return errors_; }
  size_t skipped() const { return skipped_.size(); }
  uint64_t nonfinite() const { return nonfinite_; }

 private:
  Expected<PassEnd> run_pass(const std::vector<SiteSamples>& work, uint32_t first, Accumulator& sums,
                             uint64_t& next_unit) {
    PassHandlers handlers;
    handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) {
      nonfinite_ += result.nonfinite;
      WorkUnit here = unit;
      for (uint32_t& site : here.sites) site -= first;
      return sums.add(here, result);
    };
    handlers.on_skipped = [&](const WorkUnit& unit, const std::string&) {
      skipped_.insert(unit.sites.begin(), unit.sites.end());
    };
    handlers.on_progress = [&](const FarmProgress& f) {
      BakeProgress p;
      p.stage = "probes";
      p.done = f.weight > 0 ? f.weight_done / f.weight : 0;
      p.rays = f.rays;
      p.workers = f.workers;
      task_.progress(p);
    };
    const uint32_t tile = std::min(settings_.tile_texels, kTileProbes);
    return farm_.run_pass(cut_pass(work, tile, {}, next_unit), deadline_ms_, handlers);
  }

  const ProbeTask& task_;
  const BakeSettings& settings_;
  FarmJob& farm_;
  std::span<const uint32_t> volumes_;  // by site
  const int64_t deadline_ms_;
  const MomentLayout layout_;
  const double z_;
  ProbeErrors errors_;
  std::set<uint32_t> skipped_;
  uint64_t nonfinite_ = 0;
};

ProbeField empty_field(const ProbeLayout& layout, bool visibility) {
  ProbeField f;
  f.place = layout.place;
  f.state = layout.state;
  f.validity = layout.validity;
  f.light.resize(layout.size());
  f.error.resize(layout.size());
  for (auto& e : f.error) e.fill(std::numeric_limits<float>::infinity());
  f.irradiance_error.assign(layout.size(), std::numeric_limits<float>::infinity());
  f.samples.assign(layout.size(), 0);
  if (visibility) {
    f.irradiance.assign(layout.size() * kIrradianceTexels, Vec3(0.0f));
    f.distance.assign(layout.size() * kDistanceTexels, Vec2(0.0f));
  }
  return f;
}

// The light of inactive probes: that of those which stand in.
void fill_inactive(const Scene& scene, const ProbeLayout& layout, ProbeField& field) {
  const auto sources = sources_of_inactive(scene, layout);
  for_each_index(layout.size(), 0, [&](size_t i) {
    if (layout.state[i] != ProbeState::kInactive) return;
    for (const ProbeSource& s : sources[i]) {
      for (size_t k = 0; k < kHarmonics; ++k) field.light[i][k] += s.weight * field.light[s.probe][k];
      for (uint32_t t = 0; !field.irradiance.empty() && t < kIrradianceTexels; ++t)
        field.irradiance[i * kIrradianceTexels + t] +=
            s.weight * field.irradiance[size_t{s.probe} * kIrradianceTexels + t];
    }
  });
}

// The job's sites: active probes.
struct Sites {
  std::vector<uint32_t> probes, volumes;
  bool visibility = false;
};
Sites find_sites(const ProbeLayout& layout) {
  Sites sites;
  std::vector<uint32_t> volume(layout.size());
  for (uint32_t v = 0; v < layout.volumes.size(); ++v) {
    sites.visibility |= layout.volumes[v].visibility;
    for (const ProbeBrick& b : layout.volumes[v].bricks)
      for (const uint32_t p : b.probes) volume[p] = v;
  }
  for (uint32_t p = 0; p < layout.size(); ++p) {
    if (layout.state[p] == ProbeState::kInactive) continue;
    sites.probes.push_back(p);
    sites.volumes.push_back(volume[p]);
  }
  return sites;
}

Expected<JobSpec> make_probe_job(const ProbeTask& task, const Sites& sites, const ProbeLayout& layout,
                                 ChunkStore& chunks) {
  KILN_TRY(JobSpec job, make_transport(task.request.settings));
  job.scene = write_scene(task.preflight.imported.scene, chunks);
  ProbePoints points;
  for (const uint32_t p : sites.probes) points.points.push_back({layout.place[p], layout.reach[p]});
  job.atlas = chunks.add(write_probe_points(points));
  KILN_TRY(job.transport.basis, find_basis("sh_l2"));
  job.transport.quantities = {};
  job.transport.quantities.probes = true;
  job.transport.quantities.probe_visibility = sites.visibility;
  return job;
}

int64_t deadline_of(const ProbeTask& task) {
  const double limit = task.request.settings.time_limit;
  if (limit <= 0) return 0;
  const double seconds = std::max(0.0, limit - task.watch.seconds());
  const double share = wants_lightmap(task.request.settings) ? kTimeShare : 1;
  return SteadyClock().now_ms() + 1 + static_cast<int64_t>(1000 * share * seconds);
}

void report_errors(const ProbeField& field, ProbeFigures& figures) {
  std::vector<double> relative;
  double samples = 0, lit = 0;
  for (size_t i = 0; i < field.size(); ++i) {
    if (field.samples[i] == 0) continue;
    samples += field.samples[i];
    lit += 1;
    const float e = kPi * luminance(field.light[i][0]) * 0.2820947918f;
    if (e > 0) relative.push_back(field.irradiance_error[i] / e);
  }
  if (lit > 0) figures.samples = samples / lit;
  if (relative.empty()) return;
  std::sort(relative.begin(), relative.end());
  figures.median_relative = relative[relative.size() / 2];
  figures.p95_relative = relative[relative.size() * 95 / 100];
}

// scene.glb beside files of probes that are in the folder already.
Expected<OutputFile> write_scene_of_probes(const ProbeTask& task, const std::filesystem::path& folder) {
  const Preflight& pre = task.preflight;
  KILN_TRY(const PublishedProbes published, read_published_probes(folder));
  const Lightmap none;
  OutputContext context{
      task.request.settings, pre.imported.scene, pre.atlas, pre.imported.document, none, folder};
  context.display = &pre.imported.display;
  context.probes = &published;
  KILN_TRY(const std::vector<std::string> names, write_gltf_of_probes(context));
  KILN_TRY(const Bytes bytes, read_file(folder / names.front()));
  return OutputFile{names.front(), bytes.size(), sha256(bytes), false};
}

}  // namespace

uint64_t probe_bytes(bool visibility) {
  Quantities q;
  q.probes = true;
  q.probe_visibility = visibility;
  const uint64_t sums = MomentLayout(*find_basis("sh_l2"), q).planes() * sizeof(double) * kReplicates;
  // Layout, bricks, results on their way, and what is written; measured by docs/probes.md.
  const uint64_t kept = visibility ? kIrradianceTexels * sizeof(Vec3) + kDistanceTexels * sizeof(Vec2) : 0;
  return (visibility ? 0 : sums) + 2 * kept + 1200;
}

Expected<BakedProbes> bake_probes(const ProbeTask& task) {
  const StageTimer timer(task.report.stages, "probes");
  const Stopwatch watch;
  BakedProbes out{*task.preflight.probes, {}};
  const Sites sites = find_sites(out.layout);
  ChunkStore chunks;
  KILN_TRY(const JobSpec job, make_probe_job(task, sites, out.layout, chunks));
  KILN_TRY(FarmJob* const farm, task.workplace.open(job, chunks));
  const size_t count = sites.probes.size(), run = sites.visibility ? kTogether : count;
  ProbeFigures& figures = task.report.probes;
  const int64_t deadline_ms = deadline_of(task);
  for (bool again = true; again;) {
    again = false;
    out.field = empty_field(out.layout, sites.visibility);
    uint64_t next_unit = units_before(job.atlas, kUnitsOfProbes) + 1;
    ProbePasses passes(task, job, *farm, sites.volumes, deadline_ms);
    for (size_t first = 0; first < count && !again; first += run) {
      const size_t here = std::min(run, count - first);
      Accumulator sums(here, MomentLayout(job.transport.basis, job.transport.quantities));
      KILN_TRY(const PassEnd end, passes.run(static_cast<uint32_t>(first), sums, next_unit));
      again = end == PassEnd::kRewound;
      if (again) break;
      resolve_probes(sums, passes.errors(), std::span(sites.probes).subspan(first, here), out.field);
      figures.complete = end == PassEnd::kComplete;
    }
    figures.skipped = passes.skipped();
    if (passes.nonfinite() > 0)
      task.report.warnings.push_back(
          text("{} samples of probes had radiance beyond float range and were dropped", passes.nonfinite()));
  }
  const FarmStatistics farm_figures = farm->statistics();
  task.workplace.close();  // before its chunks are destroyed
  if (!wants_lightmap(task.request.settings)) task.report.farm = farm_figures;
  if (std::any_of(sites.probes.begin(), sites.probes.end(),
                  [&](uint32_t p) { return out.field.samples[p] == 0; }) &&
      task.request.settings.time_limit > 0)
    return fail(
        ErrorKind::kTooShort,
        text("{}: --time-limit {} is too short: not every probe could be sampled; nothing was published. "
             "Give it more time, or a larger --probe-spacing",
             task.request.scene.string(), task.request.settings.time_limit));
  fill_inactive(task.preflight.imported.scene, out.layout, out.field);
  if (task.request.settings.probe_dering)
    for_each_index(out.field.size(), 0,
                   [&](size_t i) { out.field.light[i] = without_ringing(out.field.light[i]); });
  figures.volumes = out.layout.volumes.size();
  figures.probes = out.layout.size();
  figures.inactive = out.layout.size() - count;
  figures.moved =
      static_cast<uint64_t>(std::count(out.layout.state.begin(), out.layout.state.end(), ProbeState::kMoved));
  figures.rays = farm_figures.rays;
  figures.worker_seconds = farm_figures.worker_seconds;
  report_errors(out.field, figures);
  figures.seconds = watch.seconds();
  return out;
}

Expected<std::vector<ProbeBox>> probe_boxes(const ImportResult& imported, const BakeSettings& settings) {
  const auto around = [&] {
    return std::vector<ProbeBox>{box_around(imported.scene, settings.probe_spacing,
                                            std::max(settings.probe_max_spacing, settings.probe_spacing))};
  };
  if (settings.probes == "off") return std::vector<ProbeBox>{};
  if (settings.probes == "auto") return around();
  if (settings.probes != "scene") return read_probe_file(settings.probes);
  if (imported.probes.empty() && settings.probes_asked) return around();
  return imported.probes;
}

ProbeFileWish probe_files_of(const BakeSettings& settings) {
  return {settings.probe_bevy, settings.probe_textures};
}

Expected<std::optional<ProbeLayout>> plan_probes(const ImportResult& imported, const BakeSettings& settings,
                                                 uint64_t memory) {
  KILN_TRY(const std::vector<ProbeBox> boxes, probe_boxes(imported, settings));
  if (boxes.empty()) return std::optional<ProbeLayout>{};
  ProbeLimits limits;
  limits.most = settings.max_probes;
  limits.visibility = settings.probe_visibility;
  limits.may_coarsen = boxes.size() == 1 && boxes.front().name == "auto";
  const bool visibility = limits.visibility || std::any_of(boxes.begin(), boxes.end(),
                                                           [](const ProbeBox& b) { return b.visibility; });
  limits.accept = [&](uint64_t probes) -> Status {
    const uint64_t bytes = probes * probe_bytes(visibility);
    if (bytes > memory)
      return fail(ErrorKind::kInvalidInput,
                  text("{} probes need about {} MiB and this machine has {}: give them a larger spacing",
                       probes, bytes >> 20, memory >> 20));
    if (settings.probe_textures && probes > most_textured_probes(visibility))
      return fail(
          ErrorKind::kInvalidInput,
          text("--probe-files textures: {} probes are more than the {} whose textures have sides of {} at "
               "most: give them a larger spacing or --max-probes {}",
               probes, most_textured_probes(visibility), kTextureSide, most_textured_probes(visibility)));
    return {};
  };
  KILN_TRY(ProbeLayout layout, lay_out_probes(imported.scene, boxes, limits));
  return std::optional<ProbeLayout>(std::move(layout));
}

ProbePlan describe_probes(const ProbeLayout& layout, const BakeSettings& settings) {
  ProbePlan p;
  p.volumes = layout.volumes.size();
  p.probes = layout.size();
  p.inactive = layout.size() - layout.active();
  for (const ProbeVolume& v : layout.volumes) {
    const double coarsest = v.spacing * static_cast<double>(1u << (v.levels - 1));
    p.spacing = p.spacing > 0 ? std::min(p.spacing, v.spacing) : v.spacing;
    p.max_spacing = std::max(p.max_spacing, coarsest);
    p.visibility |= v.visibility;
  }
  p.coordinator_bytes = p.probes * probe_bytes(p.visibility);
  constexpr uint64_t kPlanes = 6 + 4 * kHarmonics + 1;  // of probes.exr
  constexpr uint64_t kIrradianceTile = (kIrradianceSide + 2) * (kIrradianceSide + 2) * 3,
                     kDistanceTile = (kDistanceSide + 2) * (kDistanceSide + 2) * 2;
  p.output_bytes = p.probes * 4 * (kPlanes + (p.visibility ? kIrradianceTile + kDistanceTile : 0));
  if (settings.probe_textures) p.output_bytes += p.probes * texture_bytes_of_probe(p.visibility);
  const unsigned workers = settings.workers ? settings.workers : 1,
                 threads = settings.threads ? settings.threads * workers : hardware_threads();
  const double rays = settings.indirect && settings.max_bounces > 0 ? 8 : 3;
  const double second = static_cast<double>(layout.active()) * rays / (threads * kRaysPerSecond);
  p.least_seconds = second * settings.min_samples;
  p.most_seconds = second * settings.most_of_each();
  return p;
}

Status publish_probes(const ProbeTask& task, const BakedProbes& probes) {
  BakeReport& report = task.report;
  KILN_TRY(PublishFolder folder, PublishFolder::open(task.request.output));
  task.progress({.stage = "publish"});
  KILN_TRY(std::vector<OutputFile> files,
           write_probe_files(probes.layout.volumes, probes.field, probe_files_of(task.request.settings),
                             folder.path()));
  report.outputs.insert(report.outputs.end(), files.begin(), files.end());
  KILN_TRY(const OutputFile scene, write_scene_of_probes(task, folder.path()));
  report.outputs.push_back(scene);
  report.total_seconds = task.watch.seconds();
  KILN_TRY(report.files, folder.names());
  KILN_TRY_STATUS(write_file_atomic(folder.path() / "report.json", report_json(report)));
  return folder.publish("report.json");
}

}  // namespace kiln

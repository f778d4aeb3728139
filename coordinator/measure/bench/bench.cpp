#include "coordinator/measure/bench/bench.h"

#include <algorithm>
#include <set>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/measure/bench/machine.h"

namespace kiln {
namespace {

class BenchRunner {
 public:
  BenchRunner(const BenchRequest& request, const Reference& reference,
              const std::function<void(const BakeProgress&)>& progress,
              const std::function<void(const std::string&)>& note, BenchResult& result)
      : request_(request), reference_(reference), progress_(progress), note_(note), result_(result) {}

  Status run() {
    for (uint32_t repeat = 0; repeat < request_.repeats; ++repeat)
      for (const Configuration& c : request_.configurations)
        for (const double budget : c.by_samples ? request_.samples : request_.errors) {
          if (repeat > 0 && !known_.count({c.name, budget})) break;
          KILN_TRY(const bool last, run_one(c, budget, repeat));
          if (repeat > 0) continue;
          known_.insert({c.name, budget});
          if (last) break;
        }
    return {};
  }

 private:
  // Whether to stop climbing the ladder.
  Expected<bool> run_one(const Configuration& c, double budget, uint32_t repeat) {
    MeasureRequest m;
    m.scene = request_.scene;
    m.folder = request_.output / "run";
    m.worker_program = request_.worker_program;
    KILN_TRY(m.settings, settings_of_run(request_.settings, c, budget, repeat));
    KILN_TRY(BenchRun run, measure_run(m, reference_, progress_));
    run.configuration = c.name;
    run.budget = budget_text(c, budget);
    run.budget_value = budget;
    run.repeat = repeat;
    const auto& k = run.comparison.calibration;
    note_(text("{:10} {:14} {:8.2f} s {:10.3g} rays  relMSE {:.3g}{}", c.name, run.budget, run.seconds,
               static_cast<double>(run.rays), run.comparison.rel_mse,
               k ? text(", stated {:.3g}", k->stated_rel_mse) : ""));
    const bool last = run.seconds > request_.most_seconds || run.comparison.rel_mse < kGoodEnough;
    result_.runs.push_back(std::move(run));
    return last;
  }

  const BenchRequest& request_;
  const Reference& reference_;
  const std::function<void(const BakeProgress&)>& progress_;
  const std::function<void(const std::string&)>& note_;
  BenchResult& result_;
  std::set<std::pair<std::string, double>> known_;  // rungs that the first repeat reached
};

CurvePoint point_of(const std::vector<const BenchRun*>& repeats) {
  const auto median_of = [&](auto&& value) {
    std::vector<double> all;
    for (const BenchRun* run : repeats) all.push_back(value(*run));
    return median(std::move(all));
  };
  CurvePoint p;
  p.budget = repeats.front()->budget;
  p.seconds = median_of([](const BenchRun& r) { return r.seconds; });
  p.core_seconds = median_of([](const BenchRun& r) { return r.core_seconds; });
  p.rays = median_of([](const BenchRun& r) { return static_cast<double>(r.rays); });
  p.rel_mse = median_of([](const BenchRun& r) { return r.comparison.rel_mse; });
  return p;
}

}  // namespace

std::vector<BenchCurve> curves_of(const std::vector<BenchRun>& runs) {
  std::vector<BenchCurve> curves;
  for (const BenchRun& first : runs) {
    if (first.repeat != 0) continue;
    auto at = std::find_if(curves.begin(), curves.end(),
                           [&](const BenchCurve& c) { return c.configuration == first.configuration; });
    if (at == curves.end()) at = curves.insert(at, BenchCurve{first.configuration, {}, {}, {}});
    std::vector<const BenchRun*> repeats;
    for (const BenchRun& run : runs)
      if (run.configuration == first.configuration && run.budget_value == first.budget_value)
        repeats.push_back(&run);
    at->points.push_back(point_of(repeats));
  }
  for (BenchCurve& curve : curves) {
    std::vector<double> seconds, rays, error;
    for (const CurvePoint& p : curve.points) {
      seconds.push_back(p.seconds);
      rays.push_back(p.rays);
      error.push_back(p.rel_mse);
    }
    for (size_t k = 0; k < std::size(kTargets); ++k) {
      curve.seconds[k] = find_crossing(seconds, error, kTargets[k]);
      curve.rays[k] = find_crossing(rays, error, kTargets[k]);
    }
  }
  return curves;
}

Expected<BenchResult> run_bench(const BenchRequest& request,
                                const std::function<void(const BakeProgress&)>& progress,
                                const std::function<void(const std::string&)>& note) {
  KILN_TRY_STATUS(prepare_output_folder(request.output, 0));
  ReferenceRequest r;
  r.scene = request.scene;
  r.settings = request.settings;
  r.samples = request.reference_samples;
  r.share = request.reference_share;
  r.cache = request.reference_cache;
  r.error = request.reference_error;
  r.folder = request.references;
  r.worker_program = request.worker_program;
  KILN_TRY(const Reference reference, obtain_reference(r, progress));
  BenchResult result;
  result.scene = request.scene.stem().string();
  result.machine = machine_text();
  result.reference_key = reference.key;
  result.reference_folder = reference.folder;
  result.reference_samples = request.reference_samples;
  result.reference_share = request.reference_share;
  result.reference_reused = reference.reused;
  KILN_TRY(const Comparison halves, compare_maps(reference.half[0], reference.half[1], nullptr, {}));
  result.texels = halves.texels;
  result.reference_rel_mse = 0.25 * halves.rel_mse;
  note(text("reference {} ({}): {} samples in each half, its own relMSE {:.3g}", reference.folder.string(),
            reference.reused ? "kept from before" : text("baked in {:.0f} s", reference.seconds),
            request.reference_samples, result.reference_rel_mse));
  KILN_TRY_STATUS(BenchRunner(request, reference, progress, note, result).run());
  result.curves = curves_of(result.runs);
  return result;
}

}  // namespace kiln

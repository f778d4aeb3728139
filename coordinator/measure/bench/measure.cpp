#include "coordinator/measure/bench/measure.h"

namespace kiln {

double map_seconds(const std::vector<StageTime>& stages) {
  double sum = 0;
  bool counts = false;
  for (const StageTime& stage : stages) {
    if (stage.name == "neighbours" || stage.name == "bake") counts = true;  // the first is the denoiser's
    if (stage.name == "textures") counts = false;
    if (counts) sum += stage.seconds;
  }
  return sum;
}

Expected<BenchRun> measure_run(const MeasureRequest& r, const Reference& reference,
                               const std::function<void(const BakeProgress&)>& progress) {
  if (r.settings.two_pass)
    return fail(ErrorKind::kUsage,
                "--two-pass on cannot be measured: its maps have another layout than the reference");
  BakeRequest bake;
  bake.scene = r.scene;
  bake.output = r.folder;
  bake.settings = r.settings;
  bake.worker_program = r.worker_program;
  bake.pictures = false;
  KILN_TRY(const BakeReport report, run_bake(bake, progress));
  const auto map = read_error_map(r.folder);
  std::error_code code;
  std::filesystem::remove_all(r.folder, code);
  if (!map) return tl::unexpected<Error>(map.error());
  BenchRun run;
  CompareSettings compare;
  compare.error = r.settings.error;
  compare.confidence = r.settings.confidence;
  compare.worst = 0;
  KILN_TRY(run.comparison, compare_maps(*map, reference.half[0], &reference.half[1], compare));
  run.total_seconds = report.total_seconds;
  run.seconds = map_seconds(report.stages);
  run.core_seconds = report.farm.worker_seconds;
  run.rays = report.farm.rays;
  run.texels = report.plan.valid_texels;
  run.complete = report.complete;
  const BakeSettings defaults;
  for (const Setting& row : settings_table())
    if (const std::string value = row.print(r.settings); value != row.print(defaults))
      run.settings.emplace_back(row.name, value);
  return run;
}

}  // namespace kiln

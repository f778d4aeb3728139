#include <cmath>
#include <cstdio>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/progress.h"
#include "coordinator/report/texture_report.h"
#include "coordinator/run/bake_run.h"

namespace kiln {
namespace {

std::string percent(double share) {
  return std::isfinite(share) ? text("{:.1f} %", 100 * share) : "unknown";
}

/// Says that --error is reached, and of what: a map can be within it as a whole while many of its texels are
/// not.
const char* reached_text(const BakeReport& r) {
  if (stopped_by(r) != "error") return "";
  if (r.settings.error_norm != "mean-square") return "; --error is reached";
  return "; the map as a whole is within --error (--error-norm max asks every texel)";
}

void print_light(const BakeReport& r) {
  const MapStatement& m = r.statement;
  std::printf("relative error: median %s, 95th percentile %s\n", percent(m.median_relative).c_str(),
              percent(m.p95_relative).c_str());
  std::printf("%s of texels within %g %% at %g %% confidence%s\n", percent(m.within_target).c_str(),
              100 * r.settings.error, 100 * r.settings.confidence, reached_text(r));
}

void print_statement(const BakeReport& r) {
  const MapStatement& m = r.statement;
  for (const ResponseStatement& s : r.responses)
    std::printf(
        "%s: standard error %.4f in the median, %.4f at the 95th percentile; %s of texels within %g\n",
        s.name.c_str(), s.median_error, s.p95_error, percent(s.within_target).c_str(),
        r.settings.visibility_error);
  if (r.settings.quantities.light) print_light(r);
  const auto count = [&](uint64_t n, const char* what) {
    if (n > 0)
      std::printf(
          "%llu texels (%s) %s\n", static_cast<unsigned long long>(n),
          percent(static_cast<double>(n) / static_cast<double>(std::max<uint64_t>(1, m.texels))).c_str(),
          what);
  };
  count(m.never_sampled, "were never sampled and are filled from their neighbours");
  count(m.met_no_light, "received no light");
  if (const std::string next = next_step(r); !next.empty()) std::printf("%s\n", next.c_str());
}

void print_probes(const ProbeFigures& p) {
  if (p.volumes == 0) return;
  std::printf(
      "%llu probes in %s, %llu of them inside geometry and %llu moved: error of E %s in the median, %s at "
      "the 95th percentile\n",
      static_cast<unsigned long long>(p.probes), duration_text(p.seconds).c_str(),
      static_cast<unsigned long long>(p.inactive), static_cast<unsigned long long>(p.moved),
      percent(p.median_relative).c_str(), percent(p.p95_relative).c_str());
}

void print_result(const BakeReport& r, const std::string& folder) {
  print_probes(r.probes);
  if (!wants_lightmap(r.settings)) {
    for (const std::string& s : r.warnings) std::printf("warning: %s\n", s.c_str());
    std::printf(
        "look at:  kiln view %s     the probes in a browser\n"
        "load:     %s/scene.glb, probes.json and probes.exr (docs/probes.md)\n",
        folder.c_str(), folder.c_str());
    return;
  }
  std::printf("%llu texels in %s, %.1f million rays, %.2f million rays/s and thread\n",
              static_cast<unsigned long long>(r.plan.valid_texels), duration_text(r.total_seconds).c_str(),
              r.farm.rays / 1e6, r.farm.worker_seconds > 0 ? r.farm.rays / r.farm.worker_seconds / 1e6 : 0.0);
  print_statement(r);
  std::fputs(textures_summary(r.textures).c_str(), stdout);
  for (const ImportNote& n : r.notes) {
    if (n.kind == ImportNote::Kind::kWarning) std::printf("warning: %s\n", n.what.c_str());
    if (n.kind == ImportNote::Kind::kIgnored || n.kind == ImportNote::Kind::kNote)
      std::printf("note: %s\n", n.what.c_str());
  }
  for (const std::string& s : r.warnings) std::printf("warning: %s\n", s.c_str());
  if (!r.kept_layout.empty())
    std::printf("%llu of %llu charts kept their place\n",
                static_cast<unsigned long long>(r.atlas.kept_charts),
                static_cast<unsigned long long>(r.charts));
  if (r.settings.preview)
    std::printf("look at:  %s/preview.png   the scene through its lightmap\n", folder.c_str());
  std::printf(
      "%s%s/report.html   error against run time, maps, every setting\n"
      "          kiln view %s     the lit scene in a browser\n"
      "load:     %s/scene.glb, and %s\n",
      r.settings.preview ? "          " : "look at:  ", folder.c_str(), folder.c_str(), folder.c_str(),
      r.textures.empty() ? "irradiance.exr" : "the lightmap_* textures that it names");
  if (r.lamps.mode == "drop" && !r.lamps.in_map.empty())
    std::printf("          %zu of its lamps left out, because the map has their light (--lamps)\n",
                r.lamps.in_map.size());
}

int run(const Arguments& a, const BakeSettings& settings) {
  BakeRequest request;
  request.scene = a.get("scene");
  request.output = a.get("output");
  request.settings = settings;
  request.worker_program = worker_program();
  Expected<BakeReport> report = [&] {
    ProgressPrinter progress(a.has("json") || a.has("quiet"));
    return run_bake(request, [&](const BakeProgress& p) { progress(p); });
  }();
  if (!report) return report_error(report.error());
  if (a.has("json"))
    std::fputs(report_json(*report).c_str(), stdout);
  else
    print_result(*report, request.output.string());
  if (!report->unmet.empty()) return report_error({ErrorKind::kUnavailable, report->unmet});
  return report->statement.never_sampled > 0 ? kExitIncomplete : 0;
}

}  // namespace

Command bake_command() {
  return {"bake",
          "Bake a scene on this machine: start workers on loopback and publish a folder",
          "kiln bake scene.glb -o out --texels-per-metre 8 --sun 0.4,1,0.3:5,4.7,4.2 --environment 0.6,0.8,1",
          {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true},
           {"-o,--output", "DIR", "output folder, created if needed", true},
           {"--json", "", "print report.json instead of a summary"},
           {"--quiet", "", "do not print progress"}},
          true,
          run};
}

}  // namespace kiln

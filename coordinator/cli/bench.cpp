#include <charconv>
#include <cstdio>
#include <sstream>

#include "common/base/format.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/progress.h"
#include "coordinator/measure/bench/results.h"

namespace kiln {
namespace {

Expected<uint32_t> count_option(const Arguments& a, const char* name, uint32_t fallback, uint32_t most) {
  if (!a.has(name)) return fallback;
  const std::string given = a.get(name);
  uint32_t value = 0;
  const auto [end, code] = std::from_chars(given.data(), given.data() + given.size(), value);
  if (code != std::errc() || end != given.data() + given.size() || value < 1 || value > most)
    return fail(ErrorKind::kUsage, text("--{} {}: a whole number of 1 to {} is wanted", name, given, most));
  return value;
}

Expected<std::vector<Configuration>> configurations_of(const Arguments& a) {
  if (a.has("only-reference")) return std::vector<Configuration>{};
  if (!a.has("set")) return default_configurations();
  std::vector<Configuration> out;
  std::istringstream lines(a.get("set"));
  for (std::string line; std::getline(lines, line);) {
    KILN_TRY(Configuration c, parse_configuration(line));
    for (const Configuration& other : out)
      if (other.name == c.name) return fail(ErrorKind::kUsage, text("--set names '{}' twice", c.name));
    out.push_back(std::move(c));
  }
  return out;
}

Expected<BenchRequest> request_of(const Arguments& a, const BakeSettings& settings) {
  BenchRequest r;
  r.scene = a.get("scene");
  r.output = a.get("output");
  r.settings = settings;
  r.worker_program = worker_program();
  r.references =
      a.has("references") ? std::filesystem::path(a.get("references")) : default_reference_folder();
  if (r.references.empty())
    return fail(ErrorKind::kUsage,
                "there is no cache folder to keep references in: --references DIR names one");
  KILN_TRY(r.configurations, configurations_of(a));
  KILN_TRY(r.errors, parse_budgets("errors", a.get("errors", "0.4,0.2,0.1,0.05,0.025")));
  KILN_TRY(r.samples, parse_budgets("samples", a.get("samples", "64,256,1024,4096,16384")));
  KILN_TRY(r.repeats, count_option(a, "repeats", r.repeats, 1000));
  r.reference_cache = a.has("reference-cache");
  KILN_TRY(const std::vector<double> share, parse_budgets("reference-share", a.get("reference-share", "1")));
  if (share.size() != 1 || share.front() > 1)
    return fail(ErrorKind::kUsage, text("--reference-share {}: a number above 0 and up to 1 is wanted",
                                        a.get("reference-share")));
  r.reference_share = share.front();
  if (a.has("reference-error")) {
    KILN_TRY(const std::vector<double> error, parse_budgets("reference-error", a.get("reference-error")));
    r.reference_error = error.front();
  }
  KILN_TRY(r.reference_samples, count_option(a, "reference-samples", r.reference_samples, 1u << 30));
  KILN_TRY(const std::vector<double> seconds, parse_budgets("most-seconds", a.get("most-seconds", "120")));
  r.most_seconds = seconds.front();
  return r;
}

Status bench(const Arguments& a, const BakeSettings& settings) {
  KILN_TRY(const BenchRequest request, request_of(a, settings));
  const bool quiet = a.has("json") || a.has("quiet");
  KILN_TRY(const BenchResult result, run_bench(
                                         request, [](const BakeProgress&) {},
                                         [&](const std::string& line) {
                                           if (!quiet) std::fprintf(stderr, "%s\n", line.c_str());
                                         }));
  KILN_TRY_STATUS(write_bench(result, request.output));
  if (a.has("json")) {
    std::fputs(bench_json(result).c_str(), stdout);
    return {};
  }
  if (result.curves.empty()) {
    std::printf("reference  %s\n", result.reference_folder.string().c_str());
    return {};
  }
  std::printf("%s\n%s\n\nlook at  %s/bench.png\nruns     %s/bench.csv, %s/bench.json\n",
              result.machine.c_str(), bench_table(result).c_str(), request.output.string().c_str(),
              request.output.string().c_str(), request.output.string().c_str());
  return {};
}

int run(const Arguments& a, const BakeSettings& settings) {
  const Status s = bench(a, settings);
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command bench_command() {
  return {"bench",
          "Measure error against run time and rays for chosen settings, relative to a stored reference",
          "kiln bench scene.glb -o bench --texels-per-metre 2\n"
          "  kiln bench scene.glb -o bench --set plain:cache=off --set cache:cache=on --errors 0.2,0.1,0.05 "
          "--repeats 5\n"
          "  kiln bench scene.glb -o bench --only-reference    # then: kiln compare out REF/half0 REF/half1",
          {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true},
           {"-o,--output", "DIR",
            "folder for bench.json, bench.csv, bench.svg and bench.png, created if needed", true},
           {"--set", "NAME:KEY=VALUE,...",
            "a configuration: bake settings, and ladder=error or ladder=samples; may be repeated. Default: "
            "brute, owen, cache, denoise",
            false, true},
           {"--errors", "LIST", "budgets of ladder=error, from large to small [0.4,0.2,0.1,0.05,0.025]"},
           {"--samples", "LIST", "budgets of ladder=samples, from few to many [64,256,1024,4096,16384]"},
           {"--repeats", "N", "repeats of every run, each with its own seed; the median counts [3]"},
           {"--most-seconds", "S", "a run that takes longer is the last on its ladder [120]"},
           {"--reference-samples", "N", "samples per texel in each half of the reference [16384]"},
           {"--reference-error", "E",
            "fewer of these samples, down to a sixteenth, where the map is within this error without them"},
           {"--reference-share", "X",
            "share of the texels to bake and compare, in blocks of 8 x 8, for maps of millions [1]"},
           {"--reference-cache", "",
            "bake the reference with the irradiance cache: for light that full paths rarely find"},
           {"--references", "DIR", "folder for references [$XDG_CACHE_HOME/kiln/references]"},
           {"--only-reference", "", "bake the reference if it is missing, and print its folder"},
           {"--json", "", "print bench.json"},
           {"--quiet", "", "do not print each run"}},
          true,
          run};
}

}  // namespace kiln

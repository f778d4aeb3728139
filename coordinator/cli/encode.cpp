#include <algorithm>
#include <cstdio>

#include "coordinator/cli/command.h"
#include "coordinator/cli/progress.h"
#include "coordinator/report/texture_report.h"
#include "coordinator/run/encode_run.h"

namespace kiln {
namespace {

// What a preset may say of textures and files; the rest it says of a bake, and that bake is done.
constexpr std::string_view kOfFiles[] = {
    "encode",       "container",    "encode-effort", "encode-metric", "max-encode-error", "encode-quantity",
    "encode-units", "encode-range", "ktx2-zstd",     "gltf-lightmap", "embed-basecolor",  "instanced",
    "lamps",        "preview",      "camera",        "workers",       "threads"};

// A row without a source is that of the bake's report.json.
BakeSettings without_layout_of_job_files(BakeSettings settings) {
  std::erase_if(settings.source, [](const auto& row) {
    return row.second.starts_with("job file") &&
           std::find(std::begin(kOfFiles), std::end(kOfFiles), row.first) == std::end(kOfFiles);
  });
  return settings;
}

int run(const Arguments& a, const BakeSettings& settings) {
  EncodeRequest request;
  request.scene = a.get("scene");
  request.from = a.get("from");
  request.output = a.has("output") ? a.get("output") : a.get("from");
  request.settings = without_layout_of_job_files(settings);
  const Expected<EncodeReport> report = [&] {
    ProgressPrinter progress(a.has("json") || a.has("quiet"));
    return run_encode(request, [&](const BakeProgress& p) { progress(p); });
  }();
  if (!report) return report_error(report.error());
  if (a.has("json")) {
    std::fputs(encode_json(*report).c_str(), stdout);
  } else {
    std::printf("%s", textures_summary(report->textures).c_str());
    for (const std::string& warning : report->warnings) std::printf("warning: %s\n", warning.c_str());
    std::printf("load:     %s/scene.glb\n", request.output.string().c_str());
  }
  if (!report->unmet.empty()) return report_error({ErrorKind::kUnavailable, report->unmet});
  return 0;
}

}  // namespace

Command encode_command() {
  return {
      "encode",
      "Encode textures again from a bake's masters, with other settings; does not trace rays",
      "kiln encode scene.glb --from out -o mobile --config configs/engines/mobile.json --encode-effort best",
      {{"scene", "SCENE", "the scene that was baked", true},
       {"--from", "DIR", "output folder of the bake", true},
       {"-o,--output", "DIR", "output folder [--from, whose scene.glb is rewritten to use the new textures]"},
       {"--json", "", "print encode.json instead of a summary"},
       {"--quiet", "", "do not print progress"}},
      true,
      run,
      false};
}

}  // namespace kiln

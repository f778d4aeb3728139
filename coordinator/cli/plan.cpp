#include <cstdio>

#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/progress.h"
#include "coordinator/run/bake_run.h"

namespace kiln {
namespace {

const char* kind_word(ImportNote::Kind kind) {
  static const char* kWords[] = {"baked", "approximated", "ignored", "warning"};
  return kWords[static_cast<int>(kind)];
}

void print_json(const Preflight& p) {
  JsonWriter w;
  w.begin_object().pair("layout", p.atlas.packed ? "pack" : "atlas");
  w.pair("width", p.atlas.width).pair("height", p.atlas.height).pair("pages", p.atlas.pages);
  w.pair("texels", p.plan.texels).pair("valid_texels", p.plan.valid_texels).pair("charts", p.plan.charts);
  w.pair("kept_charts", p.atlas.statistics.kept_charts);
  w.pair("triangles", p.plan.triangles).pair("stored_triangles", p.plan.stored_triangles);
  w.pair("coordinator_bytes", p.plan.coordinator_bytes).pair("worker_bytes", p.plan.worker_bytes);
  w.pair("output_bytes", p.plan.output_bytes);
  w.pair("least_seconds", p.plan.least_seconds).pair("most_seconds", p.plan.most_seconds);
  w.key("left_out").begin_array();
  for (const std::string& s : p.plan.left_out) w.value(s);
  w.end_array().key("notes").begin_array();
  for (const ImportNote& n : p.imported.notes)
    w.begin_object().pair("kind", kind_word(n.kind)).pair("what", n.what).end_object();
  for (const std::string& s : p.atlas.warnings)
    w.begin_object().pair("kind", "warning").pair("what", s).end_object();
  std::fputs(w.end_array().end_object().take().c_str(), stdout);
}

void print_text(const Preflight& p) {
  std::printf("lightmap    %s, %u x %u, %u page%s, %llu charts\n", p.atlas.packed ? "pack" : "atlas",
              p.atlas.width, p.atlas.height, p.atlas.pages, p.atlas.pages == 1 ? "" : "s",
              static_cast<unsigned long long>(p.plan.charts));
  if (p.atlas.packed && p.kept_layout.empty())
    std::printf("kept        no chart: all are placed anew (--keep-layout charts.json of an earlier bake)\n");
  else if (p.atlas.packed)
    std::printf("kept        %llu charts at their place in the earlier layout\n",
                static_cast<unsigned long long>(p.atlas.statistics.kept_charts));
  std::printf("texels      %llu to sample of %llu\n", static_cast<unsigned long long>(p.plan.valid_texels),
              static_cast<unsigned long long>(p.plan.texels));
  std::printf("triangles   %llu in %zu instances (%llu stored in %zu meshes)\n",
              static_cast<unsigned long long>(p.plan.triangles), p.imported.scene.instances.size(),
              static_cast<unsigned long long>(p.plan.stored_triangles), p.imported.scene.meshes.size());
  std::printf("lights      %zu, materials %zu, textures %zu\n", p.imported.scene.lights.size(),
              p.imported.scene.materials.size(), p.imported.scene.textures.size());
  std::printf("memory      coordinator %llu MiB, each worker %llu MiB (estimates)\n",
              static_cast<unsigned long long>(p.plan.coordinator_bytes >> 20) + 1,
              static_cast<unsigned long long>(p.plan.worker_bytes >> 20) + 1);
  std::printf("time        %s at min-samples to %s at max-samples everywhere (estimates)\n",
              duration_text(p.plan.least_seconds).c_str(), duration_text(p.plan.most_seconds).c_str());
  for (const std::string& s : p.plan.left_out) std::printf("left out    %s\n", s.c_str());
  for (const ImportNote& n : p.imported.notes) std::printf("%-11s %s\n", kind_word(n.kind), n.what.c_str());
  for (const std::string& s : p.atlas.warnings) std::printf("warning     %s\n", s.c_str());
}

int run(const Arguments& a, const BakeSettings& settings) {
  std::vector<StageTime> times;
  const auto preflight = run_preflight(a.get("scene"), settings, times, [](const BakeProgress&) {});
  if (!preflight) return report_error(preflight.error());
  a.has("json") ? print_json(*preflight) : print_text(*preflight);
  return 0;
}

}  // namespace

Command plan_command() {
  return {"plan",
          "Say what a bake would do, need and leave out, and what is wrong with the input; traces no ray",
          "kiln plan scene.glb --texels-per-metre 8",
          {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true}, {"--json", "", "print JSON"}},
          true,
          run};
}

}  // namespace kiln

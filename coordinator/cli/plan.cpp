#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/progress.h"
#include "coordinator/report/html.h"
#include "coordinator/run/bake_run.h"

namespace kiln {
namespace {

// The objects with the most texels.
void print_objects(const Preflight& p) {
  constexpr size_t kShown = 12;
  const std::vector<size_t> order = by_texels(p.plan.objects);
  std::printf("\n%-24s %-16s %7s %10s %7s %9s %10s %7s\n", "object", "material", "charts", "texels", "share",
              "texels/m", "m2", "factor");
  uint64_t shown = 0;
  const auto all = static_cast<double>(std::max<uint64_t>(1, p.atlas.statistics.mask_texels));
  for (size_t i = 0; i < std::min(kShown, order.size()); ++i) {
    const ObjectPlan& o = p.plan.objects[order[i]];
    shown += o.texels;
    std::printf("%-24.24s %-16.16s %7llu %10llu %6.1f%% %9.3g %10.4g %7.3g\n", o.name.c_str(),
                o.material.c_str(), static_cast<unsigned long long>(o.charts),
                static_cast<unsigned long long>(o.texels), 100 * static_cast<double>(o.texels) / all,
                o.texels_per_metre, o.square_metres, o.factor);
  }
  if (order.size() > kShown)
    std::printf("%-41s %7s %10llu %6.1f%%\n", text("{} more", order.size() - kShown).c_str(), "",
                static_cast<unsigned long long>(p.atlas.statistics.mask_texels - shown),
                100 * static_cast<double>(p.atlas.statistics.mask_texels - shown) / all);
}

void print_lods(const std::vector<DisplayFit>& fits) {
  for (const DisplayFit& f : fits)
    std::printf(
        "level       '%s' (level %u, from %s): %.3g m off at worst, %.3g m in the mean, %.3g m allowed; "
        "lookups within %.2g texels; %llu triangles become %llu\n",
        f.name.c_str(), f.level, f.baked.c_str(), f.worst, f.mean, f.limit, f.shift_texels,
        static_cast<unsigned long long>(f.triangles), static_cast<unsigned long long>(f.faces));
}

void print_probes(const ProbePlan& p) {
  if (p.volumes == 0) return;
  std::printf("probes      %llu in %llu volume%s, %llu of them inside geometry, %g to %g m apart%s\n",
              static_cast<unsigned long long>(p.probes), static_cast<unsigned long long>(p.volumes),
              p.volumes == 1 ? "" : "s", static_cast<unsigned long long>(p.inactive), p.spacing,
              p.max_spacing, p.visibility ? ", with visibility" : "");
  std::printf("            memory %llu MiB, files %llu MiB before compression, %s to %s (estimates)\n",
              static_cast<unsigned long long>(p.coordinator_bytes >> 20) + 1,
              static_cast<unsigned long long>(p.output_bytes >> 20) + 1,
              duration_text(p.least_seconds).c_str(), duration_text(p.most_seconds).c_str());
}

void print_text(const Preflight& p) {
  print_probes(p.plan.probes);
  if (p.atlas.texel_count() == 0) {
    for (const ImportNote& n : p.imported.notes)
      std::printf("%-11s %s\n", std::string(note_kind(n.kind)).c_str(), n.what.c_str());
    return;
  }
  std::printf("lightmap    %s, %u x %u, %u page%s, %llu charts\n", p.atlas.packed ? "pack" : "atlas",
              p.atlas.width, p.atlas.height, p.atlas.pages, p.atlas.pages == 1 ? "" : "s",
              static_cast<unsigned long long>(p.plan.charts));
  if (p.atlas.packed && p.kept_layout.empty())
    std::printf(
        "kept        no charts: all are placed again (--keep-layout charts.json of an earlier bake)\n");
  else if (p.atlas.packed)
    std::printf("kept        %llu charts at their place in the earlier layout\n",
                static_cast<unsigned long long>(p.atlas.statistics.kept_charts));
  std::printf("texels      %llu to sample of %llu, %.1f %% empty\n",
              static_cast<unsigned long long>(p.plan.valid_texels),
              static_cast<unsigned long long>(p.plan.texels), 100 * (1 - p.atlas.used_share()));
  if (p.atlas.packed) std::printf("density     %.4g texels per metre\n", p.atlas.statistics.texels_per_metre);
  std::printf("triangles   %llu in %zu instances (%llu stored in %zu meshes)\n",
              static_cast<unsigned long long>(p.plan.triangles), p.imported.scene.instances.size(),
              static_cast<unsigned long long>(p.plan.stored_triangles), p.imported.scene.meshes.size());
  std::printf("lights      %zu, materials %zu, textures %zu\n", p.imported.scene.lights.size(),
              p.imported.scene.materials.size(), p.imported.scene.textures.size());
  std::printf("memory      coordinator %llu MiB, each worker %llu MiB (estimates)\n",
              static_cast<unsigned long long>(p.plan.coordinator_bytes >> 20) + 1,
              static_cast<unsigned long long>(p.plan.worker_bytes >> 20) + 1);
  std::printf("files       %llu MiB before compression (estimate)\n",
              static_cast<unsigned long long>(p.plan.output_bytes >> 20) + 1);
  std::printf("time        %s at %u samples to %s at %u samples everywhere (estimates)\n",
              duration_text(p.plan.least_seconds).c_str(), p.plan.least_samples,
              duration_text(p.plan.most_seconds).c_str(), p.plan.most_samples);
  print_lods(p.projection.fits);
  for (const std::string& s : p.plan.left_out) std::printf("left out    %s\n", s.c_str());
  for (const ImportNote& n : p.imported.notes)
    std::printf("%-11s %s\n", std::string(note_kind(n.kind)).c_str(), n.what.c_str());
  for (const std::string& s : p.atlas.warnings) std::printf("warning     %s\n", s.c_str());
  for (const std::string& s : p.plan.warnings) std::printf("warning     %s\n", s.c_str());
  print_objects(p);
}

int run(const Arguments& a, const BakeSettings& settings) {
  std::vector<StageTime> times;
  auto preflight = run_preflight(a.get("scene"), settings, times, [](const BakeProgress&) {});
  if (!preflight) return report_error(preflight.error());
  if (settings.two_pass && preflight->atlas.packed)
    preflight->imported.notes.push_back({ImportNote::Kind::kNote,
                                         "--two-pass on: only a bake's first pass can find charts that are "
                                         "black or evenly lit; this is the layout it starts with"});
  if (a.has("json"))
    std::fputs(plan_json(preflight->view()).c_str(), stdout);
  else
    print_text(*preflight);
  if (!a.has("output")) return 0;
  const bool map = preflight->atlas.texel_count() > 0, probes = preflight->probes.has_value();
  if (!map && !probes)
    return report_error({ErrorKind::kUsage,
                         "-o is for the page of a lightmap or of probes, and none is asked for: leave it "
                         "out, or add light to --quantities"});
  if (const Status s = write_plan(a.get("scene"), *preflight, settings, a.get("output")); !s)
    return report_error(s.error());
  const std::string folder = a.get("output");
  if (!a.has("json"))
    std::printf("\nlook at     %s/plan.html%s%s\n", folder.c_str(),
                settings.preview && map ? text(", {}/density.png", folder).c_str() : "",
                settings.preview && probes ? text(", {}/probes.png", folder).c_str() : "");
  return 0;
}

}  // namespace

Command plan_command() {
  return {"plan",
          "Show what a bake would do and need, and what is wrong with the input; does not trace rays",
          "kiln plan scene.glb --texels-per-metre 8 -o plan",
          {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true},
           {"-o,--output", "DIR", "folder for plan.html, plan.json and pictures, created if needed"},
           {"--json", "", "print JSON"}},
          true,
          run};
}

}  // namespace kiln

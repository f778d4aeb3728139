#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/bake/post/stage.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/output/probes/published.h"
#include "coordinator/output/textures/textures.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/run/bake_stages.h"
#include "coordinator/run/publish_folder.h"

namespace kiln {
namespace {

void count_classes(const Lightmap& map, const Atlas& atlas, BakeReport& report) {
  for (Validity v : map.validity) ++report.texels_by_class[static_cast<int>(v)];
  for (uint32_t owner : atlas.owner) report.owned_texels += owner != 0;
  report.layout = atlas.packed ? "pack" : "atlas";
  report.width = atlas.width;
  report.height = atlas.height;
  report.pages = atlas.pages;
  report.charts = atlas.placements.size();
}

// The settings' pictures, or smaller ones where time is short, or none; what is not as asked for is said.
BakeSettings picture_settings(const BakeRequest& request, const TimeBudget& budget, BakeReport& report) {
  BakeSettings settings = request.settings;
  if (!settings.preview) return settings;
  const double scale = budget.picture_scale();
  if (scale < 1) {
    settings.preview = scale > 0;
    settings.preview_width = std::max(1u, static_cast<uint32_t>(scale * settings.preview_width));
    settings.preview_height = std::max(1u, static_cast<uint32_t>(scale * settings.preview_height));
    report.notes.push_back({ImportNote::Kind::kIgnored,
                            settings.preview
                                ? text("the pictures are {} x {} pixels: the time limit left no more time",
                                       settings.preview_width, settings.preview_height)
                                : "there are no pictures: the time limit left no time for them"});
  }
  return settings;
}

// Under a time limit scene_unlit.glb has to be asked for: its pages have up to 16 pixels a texel, which take
// longer than the masters.
BakeSettings output_settings(const BakeRequest& request, BakeReport& report) {
  BakeSettings settings = request.settings;
  const bool asked = settings.source.contains("embed-basecolor");
  if (settings.time_limit == 0 || asked || !settings.embed_basecolor || !settings.quantities.light)
    return settings;
  settings.embed_basecolor = false;
  report.notes.push_back(
      {ImportNote::Kind::kIgnored,
       "there is no scene_unlit.glb, to save time for samples: --embed-basecolor on writes it "
       "under a time limit too"});
  return settings;
}

// What became of the lamps of scene.glb.
void report_lamps(const LampChoice& lamps, const Display& display, BakeReport& report) {
  report.lamps.mode = lamps.mode;
  for (const DisplayLamp* lamp : lamps.in_map) report.lamps.in_map.push_back(lamp->name);
  report.lamps.sky_in_map = lamps.sky;
  report.lamps.others = display.lamps.size() - lamps.in_map.size();
}

}  // namespace

bool complete_map(const BakeRun& run, Lightmap& map) {
  const BakeSettings& settings = run.request.settings;
  const PostContext context{run.preflight.imported.scene, run.preflight.atlas, settings, &run.seams};
  const bool joins_seams = map.has_light && settings.seams && run.budget.has_time_for_seams();
  for (const PostStage& stage : post_stages()) {
    if (stage.name == "seams" && !joins_seams) {
      if (map.has_light && settings.seams)
        run.report.warnings.push_back(
            "seams between charts were not joined: the time limit left no time for it; give it more");
      continue;
    }
    const StageTimer timer(run.report.stages, std::string(stage.name));
    run.progress({.stage = std::string(stage.name)});
    for (Figure& figure : stage.run(map, context)) run.report.post.push_back(std::move(figure));
  }
  complete_responses(map, context);
  return joins_seams;
}

Status publish_map(const BakeRun& run, const Lightmap& map, bool seams) {
  const BakeRequest& request = run.request;
  const Preflight& pre = run.preflight;
  BakeReport& report = run.report;
  const TimeBudget& budget = run.budget;
  KILN_TRY(PublishFolder folder, PublishFolder::open(request.output));
  count_classes(map, pre.atlas, report);
  run.progress({.stage = "publish"});
  ReportPictures pictures;
  TextureResult textures;
  {
    const StageTimer timer(report.stages, "textures");
    BakeSettings settings = request.settings;
    settings.seams = seams;
    if (budget.is_quick()) {
      settings.encode_effort = "fast";
      report.notes.push_back({ImportNote::Kind::kIgnored,
                              "textures are encoded by --encode-effort fast, their error is measured on a "
                              "quarter of their blocks, and masters are written without compression: the "
                              "time limit left no more time"});
    }
    KILN_TRY(textures, make_textures({pre.imported.scene, pre.atlas, map, settings, folder.path(),
                                      budget.is_quick() ? 4u : 1u, &run.seams}));
    report.textures = textures.figures;
    report.unmet = beyond_bound(textures, request.settings);
    for (std::string& warning : coarse_textures(textures)) report.warnings.push_back(std::move(warning));
  }
  {
    const StageTimer timer(report.stages, "encode");
    std::vector<OutputFile> probe_files;
    std::optional<PublishedProbes> probes;
    if (run.probes) {
      KILN_TRY(probe_files, write_probe_files(run.probes->layout.volumes, run.probes->field,
                                              probe_files_of(request.settings), folder.path()));
      KILN_TRY(probes, read_published_probes(folder.path()));
    }
    const OutputContext context{output_settings(request, report),
                                pre.imported.scene,
                                pre.atlas,
                                pre.imported.document,
                                map,
                                folder.path(),
                                &pre.imported.display,
                                &pre.projection,
                                &textures.list,
                                &textures.files,
                                !budget.is_quick(),
                                probes ? &*probes : nullptr};
    KILN_TRY(report.outputs, write_outputs(context));
    report.outputs.insert(report.outputs.end(), probe_files.begin(), probe_files.end());
    report_lamps(choose_lamps(context), pre.imported.display, report);
  }
  if (request.pictures) {
    const StageTimer timer(report.stages, "preview");
    KILN_TRY(pictures, write_pictures(folder.path(), pre.imported, pre.atlas, map,
                                      picture_settings(request, budget, report)));
  }
  report.total_seconds = run.watch.seconds();
  if (request.pictures) {
    KILN_TRY(const std::string page, report_html(report, map, pictures, textures.error_pictures));
    KILN_TRY_STATUS(write_file_atomic(folder.path() / "report.html", page));
  }
  KILN_TRY(report.files, folder.names());
  KILN_TRY_STATUS(write_file_atomic(folder.path() / "report.json", report_json(report)));
  return folder.publish("report.json");
}

}  // namespace kiln

// The part of a bake before any ray.
#include <optional>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/unwrap/unwrap_cache.h"
#include "coordinator/bake/plan/advice.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/textures/textures.h"
#include "coordinator/report/camera.h"
#include "coordinator/report/density_view.h"
#include "coordinator/report/probe_places_view.h"
#include "coordinator/run/probe_run.h"
#include "coordinator/scene/density/density.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/scene/lods/lods.h"
#include "coordinator/scene/unseen/unseen.h"

namespace kiln {
namespace {

AtlasSettings atlas_settings(const BakeSettings& s) {
  AtlasSettings a;
  Quantities quantities = s.quantities;
  quantities.direct_apart = s.split;
  const TexelMemory memory = texel_memory(s, quantities);
  a.max_texels = std::min<uint64_t>(a.max_texels, memory_bytes() / (memory.coordinator + memory.worker));
  a.layout = s.layout == "atlas"  ? AtlasSettings::Layout::kAtlas
             : s.layout == "pack" ? AtlasSettings::Layout::kPack
                                  : AtlasSettings::Layout::kAuto;
  a.width = s.width;
  a.height = s.height;
  a.texels_per_metre = static_cast<float>(s.texels_per_metre);
  a.texel_budget = s.max_texels;
  a.max_page_size = s.page_size;
  a.power_of_two = s.power_of_two;
  a.block_align = s.block_align;
  a.mip_levels = s.mip_levels;
  a.unwrap.always = s.unwrap == "always";
  if (s.unwrap_cache != "off")
    a.unwrap.cache =
        s.unwrap_cache == "auto" ? default_cache_folder() : std::filesystem::path(s.unwrap_cache);
  a.cut_contacts = s.contact_cuts;
  return a;
}

std::string unseen_text(const AtlasStatistics& s) {
  const CollapsedCharts& unseen = s.collapsed[kUnseen];
  return text(
      "{} of {} charts are reached by no camera, light or opening: {} texels instead of {}, {:.1f} % of the "
      "map (--unseen auto)",
      unseen.charts, s.charts, unseen.texels, unseen.from, 100 * s.share(unseen.from));
}

// Reports the result of --unseen auto.
void note_unseen(const BakeSettings& settings, Preflight& pre) {
  if (settings.unseen != "auto") return;
  const auto say = [&](ImportNote::Kind kind, std::string what) {
    pre.imported.notes.push_back({kind, std::move(what)});
  };
  if (!pre.atlas.packed)
    return say(ImportNote::Kind::kIgnored,
               "--unseen auto has no effect on the file's own atlas: use --layout pack");
  if (!pre.unseen_decides)
    return say(ImportNote::Kind::kWarning,
               "--unseen auto has no effect: the scene has neither a camera nor a light; add one, or drop "
               "the option");
  say(ImportNote::Kind::kNote, unseen_text(pre.atlas.statistics));
}

// Warns of layout pack settings that have no effect on a scene's own atlas.
void warn_of_unused(const BakeSettings& settings, Atlas& atlas) {
  if (atlas.packed) return;
  if (!settings.keep_layout.empty())
    atlas.warnings.push_back("--keep-layout has no effect on the file's own atlas: use --layout pack");
  if (settings.two_pass)
    atlas.notes.push_back("--two-pass on has no effect on the file's own atlas: use --layout pack");
  if (settings.instanced)
    atlas.warnings.push_back("--instanced has no effect on the file's own atlas: use --layout pack");
}

// Builds the atlas and its findings. Updates `layout` as the advice on it needs.
Status make_atlas(const BakeSettings& settings, const LayoutWish& wish, AtlasSettings& layout,
                  Preflight& pre) {
  DensityFactors factors = density_factors(pre.imported.scene, pre.imported.density, settings);
  layout.density = std::move(factors.by_instance);
  for (std::string& note : factors.notes)
    pre.imported.notes.push_back({ImportNote::Kind::kWarning, std::move(note)});
  KeptLayout kept;
  if (!settings.keep_layout.empty()) {
    KILN_TRY(kept, read_layout(settings.keep_layout));
    layout.previous = &kept.layout;
    pre.kept_layout = kept.digest.hex();
  }
  if (wish.texels_per_metre > 0) {
    layout.texels_per_metre = wish.texels_per_metre;
    layout.texel_budget = 0;
  }
  std::optional<UnseenCharts> unseen;
  layout.collapse = wish.collapse;
  if (!wish.collapse && settings.unseen == "auto" && layout.layout != AtlasSettings::Layout::kAtlas) {
    unseen.emplace(pre.imported.scene, pre.imported.density.cameras);
    pre.unseen_decides = unseen->decides();
    layout.collapse = [&](const ChartsToSize& charts) { return unseen->find(charts); };
  }
  KILN_TRY(pre.atlas, build_atlas(pre.imported.scene, layout));
  layout.previous = nullptr;
  layout.collapse = {};
  layout.may_go_on = {};
  note_unseen(settings, pre);
  warn_of_unused(settings, pre.atlas);
  for (const std::string& note : pre.atlas.notes)
    pre.imported.notes.push_back({ImportNote::Kind::kNote, note});
  return {};
}

// Projects levels and proxies onto the atlas.
Status project_levels(const std::filesystem::path& scene, const BakeSettings& settings, Preflight& pre) {
  LodSettings lods;
  lods.distance = settings.lod_distance;
  lods.split = settings.lod_split;
  auto projection = project_display(pre.imported.display, pre.imported.scene, pre.atlas, lods);
  if (!projection)
    return fail(projection.error().kind, text("{}: {}", scene.string(), projection.error().message));
  pre.projection = std::move(*projection);
  return {};
}

// Finds where the probes are.
Status plan_its_probes(const std::filesystem::path& scene, const BakeSettings& settings, Preflight& pre,
                       std::vector<StageTime>& times,
                       const std::function<void(const BakeProgress&)>& progress) {
  const StageTimer timer(times, "probe places");
  progress({.stage = "probe places"});
  auto planned = plan_probes(pre.imported, settings);
  if (!planned) return fail(planned.error().kind, text("{}: {}", scene.string(), planned.error().message));
  pre.probes = std::move(*planned);
  if (!pre.probes) return {};
  for (std::string& note : pre.probes->notes)
    pre.imported.notes.push_back({ImportNote::Kind::kNote, std::move(note)});
  pre.import_notes = pre.imported.notes.size();
  pre.plan.probes = describe_probes(*pre.probes, settings);
  return {};
}

}  // namespace

Expected<Preflight> run_preflight(const std::filesystem::path& scene, const BakeSettings& settings,
                                  std::vector<StageTime>& times,
                                  const std::function<void(const BakeProgress&)>& progress,
                                  const std::function<Status()>& may_go_on, const LayoutWish& wish) {
  KILN_TRY_STATUS(check_settings(settings));
  KILN_TRY_STATUS(check_encodings(settings));
  Preflight pre;
  {
    const StageTimer timer(times, "import");
    progress({.stage = "import"});
    KILN_TRY(pre.imported, import_scene(scene, settings));
    KILN_TRY_STATUS(check_camera(pre.imported, settings.camera));
    pre.import_notes = pre.imported.notes.size();
    if (may_go_on) KILN_TRY_STATUS(may_go_on());
  }
  KILN_TRY_STATUS(plan_its_probes(scene, settings, pre, times, progress));
  if (!wants_lightmap(settings)) return pre;
  KILN_TRY_STATUS(lay_out_again(scene, settings, wish, pre, times, progress, may_go_on));
  return pre;
}

Status lay_out_again(const std::filesystem::path& scene, const BakeSettings& settings, const LayoutWish& wish,
                     Preflight& pre, std::vector<StageTime>& times,
                     const std::function<void(const BakeProgress&)>& progress,
                     const std::function<Status()>& may_go_on) {
  pre.imported.notes.erase(pre.imported.notes.begin() + static_cast<ptrdiff_t>(pre.import_notes),
                           pre.imported.notes.end());
  AtlasSettings layout = atlas_settings(settings);
  layout.may_go_on = may_go_on;
  {
    const StageTimer timer(times, "atlas");
    progress({.stage = "atlas"});
    KILN_TRY_STATUS(make_atlas(settings, wish, layout, pre));
  }
  // Objects without texels have none for their levels either: those stay as in the file.
  std::erase_if(pre.imported.display.shown, [&](const DisplayMesh& m) {
    const std::vector<uint32_t>& from = pre.imported.display.sets[m.set].sources;
    return std::none_of(from.begin(), from.end(), [&](uint32_t i) { return pre.atlas.receives(i); });
  });
  if (!pre.imported.display.shown.empty()) {
    const StageTimer timer(times, "lods");
    progress({.stage = "lods"});
    KILN_TRY_STATUS(project_levels(scene, settings, pre));
  }
  if (!pre.atlas.packed && !layout.density.empty())
    pre.imported.notes.push_back(
        {ImportNote::Kind::kIgnored,
         "densities of objects have no effect on the file's own atlas: use --layout pack"});
  const unsigned workers = settings.workers ? settings.workers : 1;
  pre.plan = make_plan(pre.imported.scene, pre.atlas, settings,
                       settings.threads ? settings.threads * workers : hardware_threads());
  if (pre.probes) {
    pre.plan.probes = describe_probes(*pre.probes, settings);
    pre.plan.output_bytes += pre.plan.probes.output_bytes;
    pre.plan.coordinator_bytes += pre.plan.probes.coordinator_bytes;
  }
  const TextureNeeds textures = texture_needs(settings, pre.plan.texels);
  pre.plan.output_bytes += textures.disk;
  pre.plan.coordinator_bytes += textures.memory;
  pre.plan.objects = plan_objects(pre.imported.scene, pre.atlas, layout.density);
  std::string advice =
      advise_density(pre.imported.scene, pre.atlas, layout, pre.plan.objects, pre.plan.least_seconds);
  if (!advice.empty()) pre.plan.warnings.push_back(std::move(advice));
  for (std::string& sentence : advise_layout(pre.imported.scene, pre.atlas, layout, pre.plan.objects))
    pre.plan.warnings.push_back(std::move(sentence));
  if (const Status fits = check_memory(pre.plan, pre.atlas, memory_bytes()); !fits)
    return fail(fits.error().kind, text("{}: {}", scene.string(), fits.error().message));
  return {};
}

Status write_plan(const std::filesystem::path& scene, const Preflight& pre, const BakeSettings& settings,
                  const std::filesystem::path& folder) {
  KILN_TRY_STATUS(prepare_output_folder(folder, 0));
  PlanPictures pictures;
  if (settings.preview && pre.atlas.texel_count() > 0) {
    KILN_TRY(const Camera camera,
             preview_camera(pre.imported, pre.atlas, unbaked_lightmap(pre.atlas), settings.camera));
    Picture& p = pictures.heat_map =
        density_view(pre.imported, pre.atlas, camera, settings.preview_width, settings.preview_height);
    KILN_TRY_STATUS(write_png(folder / "density.png", p.width, p.height, p.rgb));
  }
  if (settings.preview && pre.probes) {
    Picture& p = pictures.probes = probe_places_picture(pre.imported.scene, *pre.probes);
    KILN_TRY_STATUS(write_png(folder / "probes.png", p.width, p.height, p.rgb));
  }
  KILN_TRY(const std::string page, plan_html(pre.view(), scene, pictures));
  KILN_TRY_STATUS(write_file_atomic(folder / "plan.html", page));
  return write_file_atomic(folder / "plan.json", plan_json(pre.view()));
}

}  // namespace kiln

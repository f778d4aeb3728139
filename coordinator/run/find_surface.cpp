#include "coordinator/bake/neighbours/half_hidden.h"
#include "coordinator/bake/neighbours/straddling.h"
#include "coordinator/bake/neighbours/views.h"
#include "coordinator/run/bake_stages.h"

namespace kiln {

SurfaceGraph find_surface(const BakeRun& run) {
  const StageTimer timer(run.report.stages, "neighbours");
  const Scene& scene = run.preflight.imported.scene;
  SurfaceGraph surface;
  surface.sites = site_geometry(scene, run.preflight.atlas, 0);
  surface.links = surface_links(run.seams, surface.sites, 0);
  run.budget.seams_are(run.seams.find().points.size());
  const double large = share_of_large_pieces(surface.links);
  run.budget.surface_is(large);
  Figures& figures = run.report.post;
  figures.push_back({"texels on large surfaces", 100 * large, "%"});
  if (const auto seen = link_by_view(scene, surface.sites, 0, run.budget.views_seconds(), surface.links)) {
    figures.push_back({"neighbours that see other things", static_cast<double>(seen->parted), "pairs"});
    figures.push_back({"small pieces that see the same", static_cast<double>(seen->added), "pairs"});
  } else {
    run.report.notes.push_back({ImportNote::Kind::kIgnored,
                                "texels are denoised without asking what each sees: the time limit left no "
                                "time for it; some light may be smeared under furniture"});
  }
  return surface;
}

std::vector<uint8_t> misleading_sites(const BakeRun& run, const SurfaceGraph* surface) {
  if (!run.preflight.plan.cache) return {};
  const StageTimer timer(run.report.stages, "texels that mislead");
  const Scene& scene = run.preflight.imported.scene;
  const Atlas& atlas = run.preflight.atlas;
  std::vector<uint8_t> out = straddling_sites(scene, atlas);
  const std::optional<SiteGeometry> own =
      surface ? std::nullopt : std::optional(site_geometry(scene, atlas, 0));
  const auto hidden =
      half_hidden_sites(scene, atlas, surface ? surface->sites : *own, 0, run.budget.hidden_seconds());
  if (!hidden) {
    run.report.notes.push_back({ImportNote::Kind::kIgnored,
                                "paths end at texels that are half hidden too: the time limit left no time "
                                "to find them; some light may be too dark or too bright"});
    return out;
  }
  out.resize(atlas.sites.size());
  for (size_t site = 0; site < out.size(); ++site) out[site] |= (*hidden)[site];
  return out;
}

}  // namespace kiln

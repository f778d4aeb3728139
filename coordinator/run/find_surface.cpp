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

}  // namespace kiln

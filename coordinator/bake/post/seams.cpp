#include "coordinator/bake/post/stage.h"
#include "coordinator/bake/seams/join.h"

namespace kiln {

Figures join_seams(Lightmap& map, const PostContext& context) {
  if (!context.settings.seams) return {};
  SeamSettings settings;
  settings.angle_degrees = context.settings.seam_angle;
  SeamFinder own(context.scene, context.atlas);
  const SeamReport r = join_seams(map, context.seams ? *context.seams : own, settings);
  Figures figures{{"seams", static_cast<double>(r.stretches), "stretches"},
                  {"length of seams", r.metres, "m"}};
  if (r.equations == 0) return figures;
  for (Figure& f : Figures{
           {"seam equations", static_cast<double>(r.equations), ""},
           {"texels that seams may move", static_cast<double>(r.texels), "texels"},
           {"largest step of E across a seam before", 100 * r.before.largest, "%"},
           {"largest step of E across a seam after", 100 * r.after.largest, "%"},
           {"99th percentile of steps of E across seams before", 100 * r.before.p99, "%"},
           {"99th percentile of steps of E across seams after", 100 * r.after.p99, "%"},
           {"root mean square step before", 100 * r.before.rms, "%"},
           {"root mean square step after", 100 * r.after.rms, "%"},
           {"mean change of E by seams", r.change_in_errors, "stated errors"},
           {"root mean square change of E by seams", r.rms_change_in_errors, "stated errors"},
           {"change of the sum of E by seams", 100 * r.bias, "%"},
           {"99th percentile of steps after where both sides agreed but for noise", 100 * r.agreed.p99, "%"},
           {"length of seams where they did not", 100 * r.apart, "%"},
           {"values held at zero", static_cast<double>(r.held_at_zero), ""},
           {"directions held at the length of their light", static_cast<double>(r.shortened), ""},
           {"residual of the seam solve", r.residual, ""}})
    figures.push_back(std::move(f));
  return figures;
}

}  // namespace kiln

// The promise, on a bake with noise: a wall of eight pieces, a cylinder, a bevelled box and a cube.
#include "coordinator/post/stage.h"
#include "coordinator/seams/join.h"
#include "tests/seams/baked_room.h"
#include "tests/seams/plain_seams.h"

namespace kiln {
namespace {
using namespace test;

TEST(Seams, StepsFallBelowHalfAPercentOfTheLocalMean) {
  Bake room = baked_room(256);
  const PostContext context{room.scene, room.atlas, {}};
  fill_invalid(room.map, context);
  const std::vector<PlainPoint> points = plain_seam_points(room.scene, room.atlas, 1000);
  ASSERT_EQ(points.size(), 1000u);
  const Lightmap before = room.map;
  const PlainSteps was = plain_steps(room.atlas, before, points);
  const SeamReport report = join_seams(room.map, room.scene, room.atlas, {});
  const PlainSteps is = plain_steps(room.atlas, room.map, points);
  printf("step at 1,000 points: largest %.2f %% before, %.3f %% after; rms %.2f %%, %.4f %%\n",
         100 * was.largest, 100 * is.largest, 100 * was.rms, 100 * is.rms);
  printf("stretches %zu, %.2f m, equations %zu, texels %zu; report largest %.2f -> %.3f %%; moved %.2f "
         "(rms %.2f) errors, bias %.4f %%, held %zu, residual %.1e\n",
         size_t(report.stretches), report.metres, size_t(report.equations), size_t(report.texels),
         100 * report.largest_before, 100 * report.largest_after, report.change_in_errors,
         report.rms_change_in_errors, 100 * report.bias, size_t(report.held_at_zero), report.residual);
  EXPECT_GT(was.largest, 0.05);
  EXPECT_LT(is.largest, 0.005);
  for (uint32_t i = 0; i < room.scene.instances.size(); ++i) {
    std::vector<PlainPoint> of;
    for (const PlainPoint& p : points) if (p.instance[0] == i || p.instance[1] == i) of.push_back(p);
    if (of.empty()) continue;
    printf("  %-18s %4zu points: %.2f %% -> %.3f %%\n", room.scene.instances[i].name.c_str(), of.size(),
           100 * plain_steps(room.atlas, before, of).largest, 100 * plain_steps(room.atlas, room.map, of).largest);
  }
}

}  // namespace
}  // namespace kiln

// A patch of sun whose edges cross the seams of a doorstep: what joining does to them.
#include "common/job/settings.h"
#include "coordinator/bake/post/stage.h"
#include "coordinator/bake/seams/join.h"
#include "coordinator/scene/import/import.h"
#include "tests/analytic/in_process.h"
#include "tests/support/paths.h"

namespace kiln {
namespace {
using namespace test;

std::filesystem::path folder() {
  return source_dir() / "tests/scenes/flat";
}

TEST(Flat, ScriptWritesTheFilesCheckedIn) {
  if (run_command("python3 -c 'import json'").exit_status != 0) GTEST_SKIP() << "python3 is not installed";
  const TempDir out;
  const auto run = run_command("PYTHONDONTWRITEBYTECODE=1 python3 '" + (folder() / "make_flat.py").string() +
                               "' '" + out.path().string() + "'");
  ASSERT_EQ(run.exit_status, 0) << run.output;
  for (const char* name : {"flat.glb", "flat.kiln.json"})
    EXPECT_EQ(run_command("cmp '" + (out.path() / name).string() + "' '" + (folder() / name).string() + "'")
                  .exit_status,
              0)
        << name << " differs from the file checked in: run make_flat.py";
}

// Sun and sky alone: nothing else has edges.
Bake baked_flat(uint32_t samples, uint64_t seed) {
  BakeSettings settings;
  KILN_CHECK(set_option(settings, "sun", "-1,0.46,0.13:14,13,11", "test"));
  KILN_CHECK(set_option(settings, "sun-angle", "0.53", "test"));
  KILN_CHECK(set_option(settings, "environment", "0.7,0.85,1", "test"));
  auto imported = import_scene(folder() / "flat.glb", settings);
  KILN_CHECK(imported.has_value());
  TransportSettings transport;
  transport.indirect = false;
  transport.seed = seed;
  Bake b = bake(std::move(imported->scene), 8, samples, transport);
  fill_invalid(b.map, {b.scene, b.atlas, {}});
  return b;
}

struct Harm {
  double before = 0, after = 0;  // mean squared error of texels at seams, relative
  double worst = 0;              // what one texel's relative error grew by
  size_t texels = 0;
};

Harm harm(const Lightmap& before, const Lightmap& after, const Lightmap& truth,
          std::span<const SeamEquation> equations) {
  std::vector<uint32_t> texels;
  for (const SeamEquation& e : equations)
    for (const Lookup& side : e.side)
      texels.insert(texels.end(), side.texel.begin(), side.texel.begin() + side.count);
  std::sort(texels.begin(), texels.end());
  texels.erase(std::unique(texels.begin(), texels.end()), texels.end());
  const double dark = kDarkStep * mean_light(truth);
  Harm h;
  for (const uint32_t t : texels) {
    if (truth.validity[t] != Validity::kMeasured) continue;
    const double r = light_of(truth, t), scale = std::sqrt(r * r + dark * dark);
    const double was = std::abs(light_of(before, t) - r) / scale,
                 is = std::abs(light_of(after, t) - r) / scale;
    h.before += was * was;
    h.after += is * is;
    h.worst = std::max(h.worst, is - was);
    ++h.texels;
  }
  h.before /= static_cast<double>(h.texels);
  h.after /= static_cast<double>(h.texels);
  return h;
}

// Every step is closed, whatever it is.
const SeamWeights kForced{.seam = 4096, .doubt = {.close = 1e9, .part = 2e9, .change = 0}, .most = 1e9};

TEST(Flat, EdgesOfShadowsStayWhereTheyAre) {
  const Bake flat = baked_flat(256, 1), truth = baked_flat(1024, 2);
  const std::vector<SeamEquation> equations = seams_of(flat.map, flat.scene, flat.atlas, {});
  ASSERT_GT(equations.size(), 100u);
  Lightmap joined = flat.map, forced = flat.map;
  const SeamReport report = join_seams(joined, flat.scene, flat.atlas, {});
  join_seams(forced, flat.scene, flat.atlas, {}, kForced);
  const Harm h = harm(flat.map, joined, truth.map, equations);
  const Harm f = harm(flat.map, forced, truth.map, equations);
  printf(
      "%zu texels at seams: relMSE %.5f apart, %.5f joined, %.5f forced to agree; worst growth %.1f %% and "
      "%.1f "
      "%%; "
      "99th percentile of steps %.2f %%, joined %.2f %%\n",
      h.texels, h.before, h.after, f.after, 100 * h.worst, 100 * f.worst, 100 * report.before.p99,
      100 * report.after.p99);
  EXPECT_GT(f.worst, 0.5) << "the scene does not try it";
  EXPECT_GT(f.after, f.before) << "the scene does not try it";
  EXPECT_LT(h.worst, 0.3);
  EXPECT_LE(h.after, h.before);
  EXPECT_LT(report.after.rms, 0.7 * report.before.rms);
}

TEST(Flat, WhatSeamsMoveIsInTheStatedError) {
  Bake flat = baked_flat(64, 1);
  flat.map.band_error.width = flat.map.planes.width;
  flat.map.band_error.height = flat.map.planes.height;
  for (const char* band : {"L0", "L1"}) flat.map.band_error.add(band);
  Lightmap joined = flat.map;
  join_seams(joined, flat.scene, flat.atlas, {});
  size_t moved = 0;
  for (size_t t = 0; t < flat.atlas.owner.size(); ++t) {
    const double by = std::abs(light_of(joined, t) - light_of(flat.map, t));
    const double stated = joined.planes.plane("error")[t], before = flat.map.planes.plane("error")[t];
    EXPECT_GE(stated, by * (1 - 1e-6)) << t;
    EXPECT_GE(stated, before) << t;
    if (by == 0) EXPECT_EQ(stated, before) << t;
    moved += by > 0;
  }
  EXPECT_GT(moved, 50u);
}

}  // namespace
}  // namespace kiln

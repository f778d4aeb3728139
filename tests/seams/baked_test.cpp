// The promise, on a bake with noise: a wall of eight pieces, a cylinder, a bevelled box and a cube.
#include "coordinator/bake/post/stage.h"
#include "coordinator/bake/seams/join.h"
#include "tests/seams/baked_room.h"
#include "tests/seams/pieces.h"
#include "tests/seams/plain_seams.h"

namespace kiln {
namespace {
using namespace test;

// A map as the seams stage gets it.
struct Filled {
  Bake room = baked_room(256);
  Filled() { fill_invalid(room.map, {room.scene, room.atlas, {}}); }
};

TEST(Seams, StepsFallBelowTwoPercentWhereTexelsAreFinerThanTheLight) {
  Filled f;
  const Atlas& atlas = f.room.atlas;
  const std::vector<PlainPoint> points = plain_seam_points(f.room.scene, atlas, 1000);
  ASSERT_EQ(points.size(), 1000u);
  Lightmap joined = f.room.map;
  const SeamReport report = join_seams(joined, f.room.scene, atlas, {});
  printf(
      "| piece | points | largest step before | after | rms before | after |\n|---|---|---|---|---|---|\n");
  struct Row {
    const char* name;
    uint32_t first, last;
    double least_before;  // what the bake must show for the test to mean something
  };
  for (const auto& [name, first, last, least_before] : {Row{"wall of eight", 0, 7, 0.03},
                                                        {"cylinder", kCylinder, kCylinder, 0.05},
                                                        {"bevelled box", kBevelledBox, kBevelledBox, 0.3}}) {
    const std::vector<PlainPoint> some = of_pieces(points, first, last);
    ASSERT_GT(some.size(), 40u) << name;
    const PlainSteps was = plain_steps(atlas, f.room.map, some), is = plain_steps(atlas, joined, some);
    EXPECT_GT(was.largest, least_before) << name;
    // The bevel is one texel wide: light changes there by a factor of ten from texel to texel, and what the
    // two sides differ by is not theirs to settle.
    if (first != kBevelledBox) EXPECT_LT(is.largest, 0.02) << name;
    EXPECT_LT(is.rms, (first == kBevelledBox ? 1.0 : 0.1) * was.rms) << name;
    printf("| %s | %zu | %.2f %% | %.3f %% | %.2f %% | %.3f %% |\n", name, some.size(), 100 * was.largest,
           100 * is.largest, 100 * was.rms, 100 * is.rms);
  }
  printf(
      "%.2f m of seams, %zu of %zu texels may move; by %.2f stated errors in the mean; sum of E %+.4f %%\n",
      report.metres, size_t(report.texels), size_t(atlas.statistics.mask_texels), report.change_in_errors,
      100 * report.bias);
  // What one side gains the other loses.
  EXPECT_LT(std::abs(report.bias), 1e-4);
  EXPECT_EQ(report.held_at_zero, 0u);
  EXPECT_LT(report.residual, 1e-9);
}

TEST(Seams, CreasesOf90DegreesKeepTheirBits) {
  Filled f;
  const Atlas& atlas = f.room.atlas;
  Lightmap joined = f.room.map;
  join_seams(joined, f.room.scene, atlas, {});
  size_t compared = 0, changed = 0;
  for (size_t t = 0; t < atlas.owner.size(); ++t) {
    const uint32_t chart = atlas.owner[t] - 1;
    const bool crease = atlas.owner[t] && chart >= atlas.instance_first_chart[kCube];  // and floor and lamp
    for (size_t p = 0; p < joined.planes.data.size(); ++p) {
      if (crease) ASSERT_EQ(joined.planes.data[p][t], f.room.map.planes.data[p][t]) << t;
      changed += joined.planes.data[p][t] != f.room.map.planes.data[p][t];
    }
    compared += crease;
  }
  EXPECT_GT(compared, 500u);
  EXPECT_GT(changed, 1000u);
  // They do differ: the test would see a crease that was joined.
  const std::vector<PlainPoint> all = plain_seam_points(f.room.scene, atlas, 4000, 91);
  EXPECT_GT(plain_steps(atlas, joined, of_pieces(all, kCube, kCube)).largest, 0.5);
}

TEST(Seams, EveryRunGivesTheSameBits) {
  Filled f;
  Lightmap a = f.room.map, b = f.room.map;
  join_seams(a, f.room.scene, f.room.atlas, {});
  join_seams(b, f.room.scene, f.room.atlas, {});
  EXPECT_EQ(a.planes.data, b.planes.data);
}

// Corrections of one plane know nothing of another's: where they leave little light, a direction would be
// longer than it.
TEST(Seams, DirectionsStayWithinTheirLight) {
  const Scene scene = wall_of_eight().scene;
  const Atlas atlas = packed(scene, 4);
  uint64_t state = 1;
  Lightmap map = field_map(scene, atlas, [&](const DVec3&, const Vec3&) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return 0.01 + std::pow(static_cast<double>(state >> 11) * 0x1p-53, 4);  // noise: mostly dark
  });
  std::vector<float>& length = map.planes.plane("L1x.R");
  for (size_t t = 0; t < length.size(); ++t)
    length[t] = t % 3 ? -map.planes.data[0][t] : map.planes.data[0][t];
  map.planes.add("L1y.R");
  map.planes.add("L1z.R");
  const size_t x = map.planes.index("L1x.R"), y = map.planes.index("L1y.R"), z = map.planes.index("L1z.R");
  Lightmap free = map;
  EXPECT_EQ(join_seams(free, scene, atlas, {}).shortened, 0u);
  map.bounds.push_back({0, {x, y, z}});
  EXPECT_GT(join_seams(map, scene, atlas, {}).shortened, 0u);
  size_t beyond = 0;
  for (size_t t = 0; t < atlas.owner.size(); ++t) {
    const auto too_long = [&](const Lightmap& m) {
      return std::abs(m.planes.data[x][t]) > m.planes.data[0][t] * (1 + 0x1p-19);
    };
    EXPECT_FALSE(too_long(map)) << t;
    beyond += too_long(free);
  }
  EXPECT_GT(beyond, 0u) << "the field does not try it";
}

}  // namespace
}  // namespace kiln

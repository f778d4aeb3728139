// The parts of an object's density, on scenes of squares.
#include "coordinator/scene/density/factors.h"

#include <cmath>

#include "coordinator/scene/density/density.h"

namespace kiln {
namespace {

// Squares of one metre in x and z, one at each place, and a chance to say more.
struct Squares {
  explicit Squares(const std::vector<Vec3>& places) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}};
    mesh.normals.assign(4, Vec3(0, 1, 0));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.source_triangle = {0, 1};
    scene.meshes.push_back(mesh);
    scene.materials.push_back({"unlit", "m", Mat4x3(1.0f), {}});
    for (const Vec3& at : places) {
      Instance i;
      i.to_world[3] = at;
      scene.instances.push_back(i);
    }
  }
  std::vector<float> factors() const { return density_factors(scene, wishes, settings).by_instance; }
  std::vector<std::string> notes() const { return density_factors(scene, wishes, settings).notes; }

  Scene scene;
  DensityWishes wishes;
  BakeSettings settings;
};
using F = std::vector<float>;

TEST(Factors, NoRuleIsNoVector) {
  Squares s({{0, 0, 0}});
  EXPECT_TRUE(s.factors().empty());
  EXPECT_TRUE(s.notes().empty());
  s.wishes.by_instance = {1};
  EXPECT_TRUE(s.factors().empty());  // all 1: the layout is that without
}

TEST(Boxes, RaiseWhatTheyTouchAndLowerWhatIsInside) {
  Squares s({{0, 0, 0}, {0.5f, 0, 0}, {3, 0, 0}});
  s.wishes.boxes = {{DVec3(-1, -1, -1), DVec3(1.2, 1, 2), 4}};
  EXPECT_EQ(s.factors(), (F{4, 4, 1}));
  s.wishes.boxes[0].factor = 0.25;
  EXPECT_EQ(s.factors(), (F{0.25f, 1, 1}));
}

TEST(Boxes, TouchTrianglesNotTheBoundsOfTheObject) {
  Squares s({{0, 0, 0}});
  Mesh& mesh = s.scene.meshes[0];  // a second triangle pair far away: the middle of the bounds is empty
  for (int k = 0; k < 4; ++k)
    mesh.positions.push_back(mesh.positions[static_cast<size_t>(k)] + Vec3(9, 0, 0));
  mesh.normals.assign(8, Vec3(0, 1, 0));
  mesh.triangles.emplace_back(4, 5, 6);
  s.wishes.boxes = {{DVec3(4, -1, 0), DVec3(6, 1, 1), 2}};
  EXPECT_TRUE(s.factors().empty());
  s.wishes.boxes[0].high.x = 9.5;
  EXPECT_EQ(s.factors(), F{2});
}

TEST(Boxes, TheLargestCountsInAnyOrderAndTheSettingsAdd) {
  Squares s({{0, 0, 0}});
  s.wishes.boxes = {{DVec3(-1), DVec3(2), 0.5}, {DVec3(-1), DVec3(2), 3}};
  EXPECT_EQ(s.factors(), F{3});
  std::swap(s.wishes.boxes[0], s.wishes.boxes[1]);
  EXPECT_EQ(s.factors(), F{3});
  ASSERT_TRUE(set_option(s.settings, "importance-box", "2,2,2:-1,-1,-1:5", "test"));
  EXPECT_EQ(s.factors(), F{5});
  ASSERT_EQ(s.notes().size(), 2u);
  EXPECT_NE(s.notes()[0].find("changes nothing"), std::string::npos);
}

TEST(Boxes, OfTheSettingsReadWhatTheyPrint) {
  BakeSettings a, b;
  ASSERT_TRUE(set_option(a, "importance-box", "0,0,0:1,2.5,3:2", "test"));
  ASSERT_TRUE(set_option(a, "importance-box", "-1,-2,-3:0,0,0:0.5", "test"));
  for (const Setting& row : settings_table())
    if (row.name == std::string("importance-box")) {
      ASSERT_TRUE(set_option(b, row.name, row.print(a), "test"));
      EXPECT_EQ(row.print(b), "0,0,0:1,2.5,3:2 -1,-2,-3:0,0,0:0.5");
    }
  for (const char* bad : {"", "1", "0,0,0:1,1,1", "0,0:1,1,1:2", "0,0,0:1,1,1:0", "0,0,0:1,1,1:-2",
                          "0,0,0:1,1,nan:2", "0,0,0:1,1,1:65", "0,0,0:1,1,1:2 ", "0,0,0:1,1,1:2:3"})
    EXPECT_FALSE(set_option(b, "importance-box", bad, "test")) << bad;
}

TEST(Cameras, DensityFallsWithTheDistanceToTheNearestPoint) {
  // The camera at the origin; nearest points 0, 10, 20, 40 and 10^5 metres away.
  Squares s({{-0.5f, 0, -0.5f}, {10, 0, 0}, {20, 0, 0}, {-41, 0, 0}, {100000, 0, 0}});
  s.wishes.cameras.resize(1);
  EXPECT_TRUE(s.factors().empty());  // not asked for
  s.settings.importance_cameras = true;
  s.settings.camera_distance = 10;
  EXPECT_EQ(s.factors(), (F{1, 1, 0.5f, 0.25f, 1.0f / 16}));
  s.wishes.cameras.emplace_back().to_world[3] = Vec3(99999, 0, 0);  // another one by the last
  EXPECT_EQ(s.factors(), (F{1, 1, 0.5f, 0.25f, 1}));
}

TEST(Cameras, WhatNoneSeesMayHaveLess) {
  // Looking along -z: before, behind, far to the side, and a large thing partly in view.
  Squares s({{0, 0, -6}, {0, 0, 5}, {40, 0, -5}, {0, -9, -6}});
  s.scene.instances[3].to_world[1].y = 1;
  s.wishes.cameras.resize(1);
  s.settings.importance_cameras = true;
  s.settings.camera_distance = 100;
  EXPECT_TRUE(s.factors().empty());
  s.settings.unseen_density = 0.5;
  EXPECT_EQ(s.factors(), (F{1, 0.5f, 0.5f, 0.5f}));
  s.wishes.cameras[0].vertical_fov = 2.4f;  // now what is below is in view: 9 < 5 tan 1.2
  EXPECT_EQ(s.factors(), (F{1, 0.5f, 0.5f, 1}));
  s.wishes.cameras.clear();
  EXPECT_TRUE(s.factors().empty());
  ASSERT_EQ(s.notes().size(), 1u);
  EXPECT_NE(s.notes()[0].find("no perspective camera"), std::string::npos);
}

TEST(Size, SmallThingsHaveLess) {
  Squares s({{0, 0, 0}, {5, 0, 0}, {9, 0, 0}});
  s.scene.instances[1].to_world[0] *= 0.25f;  // a quarter of the diagonal
  s.scene.instances[1].to_world[2] *= 0.25f;
  s.scene.instances[2].to_world[0] *= 1e-3f;
  s.scene.instances[2].to_world[2] *= 1e-3f;
  s.settings.small_objects = std::sqrt(2.0);
  EXPECT_EQ(s.factors(), (F{1, 0.25f, 1.0f / 16}));
}

TEST(Steps, AreFixedAndNear) {
  double largest = 0;
  for (int k = 0; k <= 24; ++k) {
    const double step = std::exp2(-0.25 * k);
    EXPECT_NEAR(to_step(step), step, 1e-14);
    EXPECT_EQ(to_step(to_step(step)), to_step(step));
  }
  for (double f = 1.0 / 64; f <= 1; f *= 1.0007)
    largest = std::max(largest, std::abs(std::log2(to_step(f) / f)));
  EXPECT_LE(largest, 0.125 + 1e-12);
  EXPECT_NEAR(to_step(1e-9), 1.0 / 64, 1e-14);
}

TEST(Factors, PartsMultiplyWithinTheRange) {
  Squares s({{0, 0, 0}, {20, 0, 0}, {40, 0, 0}});
  s.wishes.by_instance = {3, 3, 40};
  s.wishes.boxes = {{DVec3(-1), DVec3(100), 2}};
  s.wishes.cameras.resize(1);
  s.settings.importance_cameras = true;
  EXPECT_EQ(s.factors(), (F{6, 3, 20}));
  s.settings.importance_cameras = false;
  EXPECT_EQ(s.factors(), (F{6, 6, 64}));
  EXPECT_EQ(most_density_factor(s.wishes, s.settings), 64);
  s.wishes.by_instance = {3, 3, 3};
  EXPECT_EQ(most_density_factor(s.wishes, s.settings), 6);
}

}  // namespace
}  // namespace kiln

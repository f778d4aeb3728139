#include "worker/bake/recentre.h"

#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

Scene square_at(const Vec3& place) {
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad(place, {0, 0, 1}, {1, 0, 0}).point(place + Vec3(0, 0.5f, 0), Vec3(1.0f));
  return m.take();
}

TEST(Recentre, ScenesThatHoldTheOriginStay) {
  Scene s = square_at({-0.5f, 0, 3});  // z: 3 to 4 is far from 0, for its size; x and y are not
  EXPECT_EQ(recentre(s), Vec3(0, 0, 3.5f));
  EXPECT_EQ(s.meshes[0].positions[0], Vec3(-0.5f, 0, -0.5f));
  EXPECT_EQ(s.lights[0].to_world[3], Vec3(-0.5f, 0.5f, -0.5f));
}

TEST(Recentre, VerticesAndTransformsMove) {
  Scene s = square_at({100000, 0, 0});
  EXPECT_EQ(recentre(s).x, 100000.5f);
  EXPECT_EQ(s.meshes[0].positions[0].x, -0.5f);
  s = square_at({0, 0, 0});
  s.lights.clear();
  s.instances[0].to_world[3] = Vec3(-100000, 0, 0);
  EXPECT_EQ(recentre(s).x, -99999.5f);
  EXPECT_EQ(s.meshes[0].positions[0].x, 0);
  EXPECT_EQ(s.instances[0].to_world[3].x, -0.5f);
}

TEST(Recentre, WhatWouldBeRoundedStays) {
  Scene s = square_at({100000, 0, 0});
  s.lights[0].to_world[3].x = 0.1f;  // 0.1 - 100000.5 is no float
  EXPECT_EQ(recentre(s), Vec3(0.0f));
  s = square_at({100000, 0, 0});
  s.instances.push_back(s.instances[0]);  // the same vertices, turned: no vertex can move for both
  s.instances[1].to_world[0] = Vec3(0.5f, 0, 0);
  s.instances[1].to_world[3].x = 50000;
  EXPECT_EQ(recentre(s), Vec3(0.0f));
}

}  // namespace
}  // namespace kiln

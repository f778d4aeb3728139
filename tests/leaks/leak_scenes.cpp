#include "tests/leaks/leak_scenes.h"

namespace kiln::test {
namespace {

SceneMaker floor_in_the_sun() {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f));
  m.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, white);
  m.environment(Vec3(1.0f)).sun({0.4f, 0.8f, 0.3f}, Vec3(6.0f), 0.5f);
  return m;
}

}  // namespace

LeakScene two_rooms(float thickness) {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f));
  m.box({-5, -0.3f, -3}, {5, 0, 3}, false, white);    // floor
  m.box({-5, 2.5f, -3}, {5, 2.8f, 3}, false, white);  // ceiling
  m.box({-4.3f, 0, -2.3f}, {-4, 2.5f, 2.3f}, false, white);
  m.box({4, 0, -2.3f}, {4.3f, 2.5f, 2.3f}, false, white);
  m.box({-4, 0, -2.3f}, {4, 2.5f, -2}, false, white);
  m.box({-4, 0, 2}, {4, 2.5f, 2.3f}, false, white);
  m.box({kWallX, 0, -2}, {kWallX + thickness, 2.5f, 2}, false, white);
  m.point({-2, 1.5f, 0.4f}, Vec3(10.0f));
  return {std::move(m), {kWallX + thickness, 0, -2}, {4, 2.5f, 2}};
}

LeakScene closed_table() {
  SceneMaker m = floor_in_the_sun();
  m.box({-1.03f, 0.7f, -0.57f}, {1.11f, 0.74f, 0.83f}, false);  // the top
  m.box({-1.03f, 0, -0.57f}, {-1.02f, 0.7f, 0.83f}, false);
  m.box({1.10f, 0, -0.57f}, {1.11f, 0.7f, 0.83f}, false);
  m.box({-1.02f, 0, -0.57f}, {1.10f, 0.7f, -0.56f}, false);
  m.box({-1.02f, 0, 0.82f}, {1.10f, 0.7f, 0.83f}, false);
  return {std::move(m), {-1.02f, 0, -0.56f}, {1.10f, 0.7f, 0.82f}};
}

LeakScene stacked_crates() {
  SceneMaker m = floor_in_the_sun();
  m.box({-1.07f, 0, -1.33f}, {0.23f, 1, -0.33f}, false);
  m.box({0.23f, 0, -1.33f}, {1.23f, 1, 0.17f}, false);
  m.box({-0.27f, 0, 0.17f}, {1.23f, 1, 1.17f}, false);
  m.box({-1.27f, 0, -0.33f}, {-0.27f, 1, 1.17f}, false);
  m.box({-0.77f, 1, -0.83f}, {0.73f, 2, 0.67f}, false);
  return {std::move(m), {-0.27f, 0, -0.33f}, {0.23f, 1, 0.17f}};
}

LeakScene curtain() {
  SceneMaker m = floor_in_the_sun();
  const uint32_t cloth = m.lambert(Vec3(0.5f), Vec3(0.0f), true);
  m.quad({-4, -0.05f, -1.9f}, {8, 0, 0}, {0, 3, 0});
  m.quad({-1.13f, -0.05f, -1.9f}, {0.3f, 0, 0.3f}, {0, 2.12f, 0}, cloth);
  m.quad({-0.83f, -0.05f, -1.6f}, {1.7f, 0, 0}, {0, 2.12f, 0}, cloth);
  m.quad({0.87f, -0.05f, -1.6f}, {0.3f, 0, -0.3f}, {0, 2.12f, 0}, cloth);
  m.quad({-1.13f, 2.07f, -1.9f}, {0, 0, 0.3f}, {2.3f, 0, 0}, cloth);  // the rail
  return {std::move(m), {-0.82f, 0, -1.9f}, {0.86f, 2.07f, -1.61f}};
}

}  // namespace kiln::test

// The query between probes.
#include "common/probes/query.h"

#include "coordinator/scene/probes/bricks.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {
namespace {

// A volume of several spacings whose probes are all active and hold light(place).
struct Filled {
  ProbeVolume volume;
  ProbeField field;
};
template <class Light>
Filled fill(const Light& light) {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.box({1, 1, 1}, {1.5f, 1.5f, 1.5f}, false);
  ProbeBox box;
  box.spacing = 0.25;
  box.max_spacing = 1;
  box.low = DVec3(0);
  box.high = DVec3(9);
  auto placed = place_bricks(box, world_triangles(m.take()), 0, 100000);
  Filled out{placed->volume, {}};
  for (const UVec3& p : placed->points) {
    out.field.place.push_back(Vec3(out.volume.place(p)));
    out.field.state.push_back(ProbeState::kActive);
    out.field.light.push_back(light(out.field.place.back()));
  }
  return out;
}

Harmonics of_one(const Vec3& l00) {
  Harmonics h{};
  h[0] = l00;
  return h;
}

TEST(ProbeQuery, OneLightEverywhereIsThatLight) {
  const Filled f = fill([](const Vec3&) { return of_one(Vec3(3, 2, 1)); });
  for (const Vec3& p : {Vec3(1.1f, 1.2f, 1.3f), Vec3(2.9f, 3.0f, 1.7f), Vec3(8, 8, 8)}) {
    const ProbeLight light = query_volume(f.volume, f.field, p, {0, 1, 0});
    EXPECT_FLOAT_EQ(light.weight, 1);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(light.irradiance[c], kPi * 0.2820948f * static_cast<float>(3 - c), 1e-5f);
  }
}

TEST(ProbeQuery, FadesOutAroundTheVolume) {
  const Filled f = fill([](const Vec3&) { return of_one(Vec3(1)); });
  EXPECT_FLOAT_EQ(query_volume(f.volume, f.field, {-0.25f, 4, 4}, {0, 1, 0}).weight, 0.75f);
  EXPECT_EQ(query_volume(f.volume, f.field, {-1, 4, 4}, {0, 1, 0}).weight, 0);
  EXPECT_EQ(query_probes(std::span(&f.volume, 1), f.field, {-5, 4, 4}, {0, 1, 0}).weight, 0);
}

// Along lines through bricks of all three spacings light that differs wildly from probe to probe makes no
// steps: those of half the length are about half as large.
TEST(ProbeQuery, HasNoStepBetweenBricks) {
  const Filled f = fill([](const Vec3& p) {
    const float wild = std::sin(37 * p.x) + std::sin(41 * p.y + 1) + std::sin(43 * p.z + 2);
    return of_one(Vec3(4 + wild));
  });
  const auto largest_step = [&](const Vec3& from, const Vec3& to, int steps) {
    float largest = 0, before = 0;
    for (int i = 0; i <= steps; ++i) {
      const Vec3 at = from + (to - from) * (static_cast<float>(i) / static_cast<float>(steps));
      const float e = query_volume(f.volume, f.field, at, Vec3(0, 0.6f, 0.8f)).irradiance.x;
      if (i > 0) largest = std::max(largest, std::abs(e - before));
      before = e;
    }
    return largest;
  };
  const std::pair<Vec3, Vec3> lines[] = {{{0.1f, 1.2f, 1.1f}, {8.9f, 1.3f, 1.2f}},
                                         {{0.1f, 0.3f, 0.2f}, {8.8f, 8.9f, 8.7f}},
                                         {{1.3f, 8.9f, 1.2f}, {1.2f, 0.1f, 5.9f}},
                                         {{0.2f, 3.0f, 3.0f}, {8.9f, 3.0f, 3.0f}}};
  for (const auto& [from, to] : lines) {
    const float coarse = largest_step(from, to, 20000), fine = largest_step(from, to, 40000);
    EXPECT_LT(fine, 0.65f * coarse) << from.x;
    EXPECT_LT(fine, 0.02f) << from.x;
  }
}

TEST(ProbeQuery, InactiveProbesCountForNothing) {
  Filled f = fill([](const Vec3&) { return of_one(Vec3(1)); });
  for (size_t i = 0; i < f.field.size(); ++i)
    if (f.field.place[i].x < 4.1f) {
      f.field.state[i] = ProbeState::kInactive;
      f.field.light[i] = of_one(Vec3(1000));
    }
  EXPECT_NEAR(query_volume(f.volume, f.field, {4.5f, 4, 4}, {0, 1, 0}).irradiance.x, kPi * 0.2820948f, 1e-5f);
  EXPECT_EQ(query_volume(f.volume, f.field, {0.5f, 4, 4}, {0, 1, 0}).weight, 0);
}

TEST(ProbeHarmonics, WindowsUntilNothingIsNegative) {
  const Vec3 d = normalize_or(Vec3(1, 2, 3), Vec3(0));
  Harmonics sharp;
  const auto y = harmonics_at(d);
  for (size_t k = 0; k < kHarmonics; ++k) sharp[k] = Vec3(y[k]);
  const Harmonics calm = without_ringing(sharp);
  float low = 0, least = 0;
  for (int i = 0; i < 2000; ++i) {
    const float z = 1 - (2 * static_cast<float>(i) + 1) / 2000, r = std::sqrt(1 - z * z),
                a = 2.4f * static_cast<float>(i);
    const Vec3 n(r * std::cos(a), r * std::sin(a), z);
    low = std::min(low, harmonic_irradiance(sharp, n).x);
    least = std::min(least, harmonic_irradiance(calm, n).x);
  }
  EXPECT_LT(low, -0.01f);
  EXPECT_GT(least, -0.01f * std::abs(low));
  EXPECT_EQ(calm[0], sharp[0]);
  Harmonics even = of_one(Vec3(1));
  EXPECT_EQ(without_ringing(even), even);
}

}  // namespace
}  // namespace kiln::test

// Probes where their light is known.
#include <cmath>

#include "common/probes/octahedral.h"
#include "tests/analytic/scene_maker.h"
#include "tests/probes/in_process_probes.h"

namespace kiln::test {
namespace {

// A closed room of albedo 1/2 whose walls emit 1: radiance is 2 everywhere.
Scene furnace() {
  SceneMaker m;
  m.lambert(Vec3(0.5f), Vec3(1.0f));
  m.box({0, 0, 0}, {2, 1.5f, 1}, true);
  return m.take();
}

std::vector<Vec3> places_in_it() {
  std::vector<Vec3> places;
  for (int i = 0; i < 64; ++i)
    places.push_back({0.2f + 0.5f * static_cast<float>(i % 4), 0.2f + 0.35f * static_cast<float>(i / 4 % 4),
                      0.1f + 0.25f * static_cast<float>(i / 16)});
  return places;
}

// Deviations in stated errors: of normal ones 0.27 % are beyond three and one in 147,000 beyond four and a
// half.
class Deviations {
 public:
  void add(double difference, double error) {
    const double z = std::abs(difference) / error;
    beyond_ += z > 3;
    worst_ = std::max(worst_, z);
    squares_ += z * z;
    count_ += 1;
  }
  void expect_stated() const {
    EXPECT_LE(beyond_ / count_, 0.01);
    EXPECT_LE(worst_, 4.5);
    const double rms = std::sqrt(squares_ / count_);
    EXPECT_TRUE(rms > 0.8 && rms < 1.2) << rms;
  }

 private:
  double beyond_ = 0, worst_ = 0, squares_ = 0, count_ = 0;
};

TEST(ProbeFurnace, CoefficientsAreWithinThreeErrors) {
  const BakedField baked = bake_probes_at(furnace(), places_in_it(), 1024, false);
  const double l00 = 2 * std::sqrt(4 * M_PI);
  Deviations deviations;
  for (size_t i = 0; i < baked.field.size(); ++i)
    for (size_t k = 0; k < kHarmonics; ++k) {
      const Vec3& c = baked.field.light[i][k];
      EXPECT_EQ(c.x, c.y);
      EXPECT_LT(baked.field.error[i][k], 0.02 * l00);
      deviations.add(c.x - (k ? 0 : l00), baked.field.error[i][k]);
    }
  deviations.expect_stated();
}

TEST(ProbeFurnace, OctahedralTexelsAreWithinThreeErrors) {
  const BakedField baked = bake_probes_at(furnace(), places_in_it(), 1024, true);
  Deviations deviations;
  for (size_t i = 0; i < baked.field.size(); ++i)
    for (size_t t = 0; t < kIrradianceTexels; ++t)
      deviations.add(baked.field.irradiance[i * kIrradianceTexels + t].x - 2 * M_PI,
                     baked.field.irradiance_error[i]);
  deviations.expect_stated();
}

// A room that is lit by nothing but its walls has no preferred direction; a sun has one.
TEST(ProbeFurnace, ASunInTheOpen) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({-1, -5, -1}, {0, 0, 2}, {2, 0, 0});
  m.sun({0.4f, 1, 0.3f}, Vec3(3, 2, 1));
  const BakedField baked = bake_probes_at(m.take(), {{0, 1, 0}, {5, 2, 5}}, 64, true);
  const Vec3 d = Vec3(0.4f, 1, 0.3f) / length(Vec3(0.4f, 1, 0.3f));
  for (size_t i = 0; i < 2; ++i) {
    const std::array<float, kHarmonics> y = harmonics_at(d);
    for (size_t k = 0; k < kHarmonics; ++k)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(baked.field.light[i][k][c], y[k] * static_cast<float>(3 - c), 2e-5f) << k;
    for (uint32_t t = 0; t < kIrradianceTexels; ++t) {
      const Vec3 n = octahedral_texel(t % kIrradianceSide, t / kIrradianceSide, kIrradianceSide);
      EXPECT_NEAR(baked.field.irradiance[i * kIrradianceTexels + t].x, 3 * std::max(0.0f, dot(d, n)), 1e-4f);
    }
  }
}

// Distances to the walls of an empty box, weighted as probes weigh them, by quadrature.
double mean_distance(const Vec3& at, const Vec3& low, const Vec3& high, const Vec3& axis, int power) {
  double sum = 0, weights = 0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < 2 * kSteps; ++j) {
      const double z = 1 - (2.0 * i + 1) / kSteps, phi = (j + 0.5) * M_PI / kSteps, r = std::sqrt(1 - z * z);
      const DVec3 d(r * std::cos(phi), r * std::sin(phi), z);
      const double w = std::pow(std::max(0.0, dot(d, DVec3(axis))), 50);
      if (w < 0.001) continue;
      double t = 1e9;
      for (int k = 0; k < 3; ++k) t = std::min(t, ((d[k] > 0 ? high[k] : low[k]) - at[k]) / d[k]);
      sum += w * std::pow(t, power);
      weights += w;
    }
  return sum / weights;
}

TEST(ProbeDistances, OfAnEmptyBoxAreThoseOfQuadrature) {
  const Vec3 at(0.7f, 0.6f, 0.45f), low(0.0f), high(2, 1.5f, 1);
  const BakedField baked = bake_probes_at(furnace(), {at}, 1 << 15, true);
  for (const uint32_t t : {0u, 5u, 23u, 77u, 120u, 135u, 136u, 200u, 255u}) {
    const Vec3 n = octahedral_texel(t % kDistanceSide, t / kDistanceSide, kDistanceSide);
    const double mean = mean_distance(at, low, high, n, 1), square = mean_distance(at, low, high, n, 2);
    EXPECT_NEAR(baked.field.distance[t].x, mean, 0.01 * mean) << t;
    EXPECT_NEAR(baked.field.distance[t].y, square, 0.01 * square) << t;
  }
}

// Bilinear lookups across the border step no more than within. E of a sky with a gradient, in the bordered
// map.
TEST(OctahedralMap, BordersContinueIt) {
  constexpr uint32_t kTile = kIrradianceSide + 2;
  const auto smooth = [](const Vec3& d) { return 2 + d.x + 0.5f * d.y * d.z + 0.7f * d.z; };
  float tile[kTile][kTile];
  for (uint32_t y = 0; y < kTile; ++y)
    for (uint32_t x = 0; x < kTile; ++x) {
      uint32_t u = x, v = y;
      octahedral_inside(kIrradianceSide, u, v);
      tile[y][x] = smooth(octahedral_texel(u, v, kIrradianceSide));
    }
  double inner = 0, outer = 0;
  for (uint32_t y = 1; y <= kIrradianceSide; ++y)
    for (uint32_t x = 1; x < kIrradianceSide; ++x) {
      inner = std::max(inner, double{std::abs(tile[y][x] - tile[y][x + 1])});
      inner = std::max(inner, double{std::abs(tile[x][y] - tile[x + 1][y])});
    }
  for (uint32_t k = 0; k < kTile; ++k)
    for (const uint32_t edge : {0u, kIrradianceSide}) {
      outer = std::max(outer, double{std::abs(tile[k][edge] - tile[k][edge + 1])});
      outer = std::max(outer, double{std::abs(tile[edge][k] - tile[edge + 1][k])});
    }
  EXPECT_LE(outer, 1.5 * inner);
  EXPECT_GT(outer, 0.1 * inner);
  // A direction on the border has two places in the map, and lookups at both agree.
  const auto at = [&](float u, float v) {
    const float x = u * kIrradianceSide + 0.5f, y = v * kIrradianceSide + 0.5f;
    const auto i = static_cast<uint32_t>(x), k = static_cast<uint32_t>(y);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(k);
    return (tile[k][i] * (1 - fx) + tile[k][i + 1] * fx) * (1 - fy) +
           (tile[k + 1][i] * (1 - fx) + tile[k + 1][i + 1] * fx) * fy;
  };
  for (float t = 0.02f; t < 1; t += 0.02f)
    for (const float edge : {0.0f, 0.9999999f}) {
      EXPECT_NEAR(at(edge, t), at(edge, 1 - t), 1e-5f);
      EXPECT_NEAR(at(t, edge), at(1 - t, edge), 1e-5f);
    }
}

TEST(OctahedralMap, GoesThereAndBack) {
  for (uint32_t t = 0; t < kDistanceTexels; ++t) {
    const Vec3 d = octahedral_texel(t % kDistanceSide, t / kDistanceSide, kDistanceSide);
    const Vec2 p = octahedral_place(d);
    EXPECT_NEAR(p.x, (static_cast<float>(t % kDistanceSide) + 0.5f) / kDistanceSide, 1e-6f);
    EXPECT_NEAR(p.y, (static_cast<float>(t / kDistanceSide) + 0.5f) / kDistanceSide, 1e-6f);
    EXPECT_NEAR(length(octahedral_direction(p) - d), 0, 1e-6f);
  }
}

}  // namespace
}  // namespace kiln::test

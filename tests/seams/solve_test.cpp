// What the solve does to maps of known fields.
#include <Eigen/Dense>

#include "common/raster/footprint.h"
#include "coordinator/bake/post/stage.h"
#include "coordinator/bake/seams/join.h"
#include "tests/atlas/shapes.h"
#include "tests/seams/pieces.h"
#include "tests/seams/plain_seams.h"

namespace kiln {
namespace {
using namespace test;

struct Wall {
  Scene scene = wall_of_eight().scene;
  Atlas atlas = packed(scene, 8);
};

double noise(const DVec3& p) {  // -1 to 1, another number for every texel
  const double s = std::sin(p.x * 127.1 + p.y * 311.7 + p.z * 74.7) * 43758.5453;
  return 2 * (s - std::floor(s)) - 1;
}

TEST(SeamSolve, AConstantFieldKeepsItsBits) {
  Wall w;
  Lightmap map = field_map(w.scene, w.atlas, [](const DVec3&, const Vec3&) { return 0.7371; });
  const Lightmap before = map;
  const SeamReport r = join_seams(map, w.scene, w.atlas, {});
  EXPECT_GT(r.equations, 100u);
  EXPECT_EQ(map.planes.data, before.planes.data);
}

TEST(SeamSolve, ALinearFieldAcrossAlignedSeamsChangesByRoundingOnly) {
  Wall w;
  Lightmap map = field_map(w.scene, w.atlas, [](const DVec3& p, const Vec3&) { return 2 + p.x + 0.5 * p.y; });
  const Lightmap before = map;
  join_seams(map, w.scene, w.atlas, {});
  // Placements are floats of up to a hundred texels (2^-18) and E rises by 1/8 a texel: 5e-7, and that of
  // both sides and of values up to 12 (2^-21).
  for (size_t t = 0; t < map.validity.size(); ++t)
    EXPECT_NEAR(map.planes.data[0][t], before.planes.data[0][t], 3e-6) << t;
}

TEST(SeamSolve, NoiseAgreesAfterwardsInEveryPlaneAndFarTexelsStay) {
  Wall w;
  Lightmap map =
      field_map(w.scene, w.atlas, [](const DVec3& p, const Vec3&) { return 4 + p.x + 0.2 * noise(p); });
  for (float& error : map.planes.plane("error")) error = 0.115f;  // of the noise: 0.2 / sqrt(3)
  map.band_error.width = map.planes.width, map.band_error.height = map.planes.height;
  map.band_error.add("L1");
  map.band_error.data[0] = map.planes.plane("error");
  const Lightmap before = map;
  const std::vector<PlainPoint> points = plain_seam_points(w.scene, w.atlas, 500);
  EXPECT_GT(plain_steps(w.atlas, map, points).largest, 0.05);
  SeamWeights weights;
  weights.reach = 3;
  const SeamReport r = join_seams(map, w.scene, w.atlas, {}, weights);
  EXPECT_LT(plain_steps(w.atlas, map, points).largest,
            0.02);                         // steps of more than 2.5 errors are left in part
  double before_step = 0, after_step = 0;  // of the signed plane
  for (const PlainPoint& p : points) {
    const auto step = [&](const Lightmap& m) {
      return std::abs(bilinear(w.atlas, m, 3, p.page[0], p.texel[0]) -
                      bilinear(w.atlas, m, 3, p.page[1], p.texel[1]));
    };
    before_step = std::max(before_step, step(before));
    after_step = std::max(after_step, step(map));
  }
  EXPECT_LT(after_step, 0.5 * before_step);
  // Beyond reach of a seam, and in the plane of samples, all bits stay.
  EXPECT_EQ(map.planes.plane("samples"), before.planes.plane("samples"));
  size_t moved = 0, set = 0;
  for (size_t t = 0; t < map.validity.size(); ++t) {
    moved += map.planes.data[0][t] != before.planes.data[0][t];
    set += is_set(map.validity[t]);
  }
  EXPECT_LE(moved, r.texels);
  EXPECT_LT(r.texels, set);
  EXPECT_LT(std::abs(r.bias), 1e-5);
}

// Noise as light has it: few bright texels among many dark ones, and each states an error after its own
// value. Whatever side is the brighter, what it loses the other gains.
TEST(SeamSolve, JoiningNoiseKeepsTheLight) {
  Wall w;
  Lightmap map = field_map(w.scene, w.atlas, [](const DVec3& p, const Vec3&) {
    return 1 - 0.1 * std::log(0.5 - 0.499 * noise(p));  // exponential, above what is sure
  });
  for (size_t t = 0; t < map.validity.size(); ++t)
    map.planes.plane("error")[t] = 0.1f * map.planes.data[0][t];
  const SeamReport r = join_seams(map, w.scene, w.atlas, {});
  EXPECT_GT(r.change_in_errors, 0.01);
  // Corrections add up to nothing; floats and values held at zero are left.
  EXPECT_LT(std::abs(r.bias), 1e-4);
}

// What is stated in the sun excuses nothing in the dark.
TEST(SeamSolve, ADarkChartBesideABrightOneWithNoiseStaysDark) {
  Pieces p;
  p.add(panel(1, 1, 1, 1), moved({0, 0, 0})).add(panel(1, 1, 1, 1), moved({1, 0, 0}));
  const Atlas atlas = packed(p.scene, 8);
  Lightmap map = field_map(p.scene, atlas, [](const DVec3&, const Vec3&) { return 1.0; });
  for (size_t t = 0; t < map.validity.size(); ++t) {
    for (int plane = 0; plane < 3; ++plane)
      if (atlas.owner[t]) map.planes.data[plane][t] = atlas.owner[t] == 1 ? 0.04f : 2.0f;
    map.planes.plane("error")[t] = 0.5f * map.planes.data[0][t];
  }
  const Lightmap before = map;
  join_seams(map, p.scene, atlas, {});
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t] == 1)
      EXPECT_NEAR(map.planes.data[0][t], before.planes.data[0][t], 0.05f * before.planes.data[0][t]) << t;
}

TEST(SeamSolve, NothingBecomesNegativeOrLessThanFinite) {
  Wall w;
  // One side of a seam is black, the other bright; and values near the end of float.
  for (const double bright : {1.0, 3e38}) {
    Lightmap map = field_map(w.scene, w.atlas, [&](const DVec3& p, const Vec3&) {
      return p.x < 4 ? 0.0 : bright * (0.5 + 0.4 * noise(p));
    });
    join_seams(map, w.scene, w.atlas, {});
    for (size_t plane = 0; plane < 3; ++plane)
      for (const float v : map.planes.data[plane]) {
        ASSERT_TRUE(std::isfinite(v));
        ASSERT_GE(v, 0.0f);
      }
  }
}

TEST(SeamSolve, TexelsThatAreNotSetTakeNoPart) {
  Wall w;
  Lightmap map = field_map(w.scene, w.atlas, [](const DVec3& p, const Vec3&) { return 4 + noise(p); });
  Lightmap holes = map;
  for (size_t t = 0; t < holes.validity.size(); t += 3)
    if (is_set(holes.validity[t])) {
      holes.validity[t] = Validity::kInside;
      for (std::vector<float>& plane : holes.planes.data) plane[t] = std::numeric_limits<float>::quiet_NaN();
    }
  const Lightmap before = holes;
  const SeamReport some = join_seams(holes, w.scene, w.atlas, {});
  const SeamReport all = join_seams(map, w.scene, w.atlas, {});
  EXPECT_GT(some.equations, 0u);
  EXPECT_LT(some.equations, all.equations);
  for (size_t t = 0; t < holes.validity.size(); ++t)
    if (is_set(holes.validity[t])) {
      EXPECT_TRUE(std::isfinite(holes.planes.data[0][t]));
    } else if (!is_set(map.validity[t])) {
      EXPECT_EQ(holes.planes.data[0][t], before.planes.data[0][t]);
    }
}

TEST(SeamSolve, FilledTexelsGiveWay) {
  Pieces p;
  p.add(panel(1, 1, 1, 1), moved({0, 0, 0})).add(panel(1, 1, 1, 1), moved({1, 0, 0}));
  const Atlas atlas = packed(p.scene, 8);
  Lightmap map = field_map(p.scene, atlas, [](const DVec3& q, const Vec3&) { return q.x < 1 ? 1.0 : 2.0; });
  // The border's column of the left panel belongs to neither: set the sides by owner.
  for (size_t t = 0; t < map.validity.size(); ++t)
    for (int plane = 0; plane < 3; ++plane)
      if (atlas.owner[t]) map.planes.data[plane][t] = 0.8f + 0.2f * static_cast<float>(atlas.owner[t]);
  // With what is stated the two sides are different: light ends at the seam.
  Lightmap sure = map;
  join_seams(sure, p.scene, atlas, {});
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t])
      EXPECT_NEAR(sure.planes.data[0][t], map.planes.data[0][t], 2 * 2 * 0.02)
          << t;                                     // twice the error of 1 %
  for (size_t t = 0; t < map.validity.size(); ++t)  // now it may be noise
    map.planes.plane("error")[t] = 0.2f * map.planes.data[0][t];
  Lightmap filled = map;
  for (size_t t = 0; t < filled.validity.size(); ++t)
    if (atlas.owner[t] == 1) filled.validity[t] = Validity::kFilled;
  const auto at_seam = [&](Lightmap& m) {
    join_seams(m, p.scene, atlas, {});
    const std::vector<PlainPoint> points = plain_seam_points(p.scene, atlas, 9);
    return bilinear(atlas, m, 0, points[4].page[0], points[4].texel[0]);
  };
  EXPECT_NEAR(at_seam(map), 1.1, 0.005);  // the weight of seams leaves so much
  EXPECT_GT(at_seam(filled), 1.16);
}

TEST(Fill, AChartWithoutAValueTakesWhatItsSeamsSay) {
  Pieces p;
  for (const float x : {0.0f, 1.0f, 2.0f, 9.0f}) p.add(panel(1, 1, 1, 1), moved({x, 0, 0}));
  const Atlas atlas = packed(p.scene, 8);
  Lightmap map = field_map(p.scene, atlas, [](const DVec3& q, const Vec3&) { return 1 + q.y; });
  const Lightmap before = map;
  for (size_t t = 0; t < map.validity.size(); ++t)
    if (atlas.owner[t] > 1) {  // the first knows; the second and third go on from it; the fourth is alone
      map.validity[t] = Validity::kEmpty;
      for (std::vector<float>& plane : map.planes.data) plane[t] = 0;
    }
  const Figures figures = fill_invalid(map, {p.scene, atlas, {}});
  double alone = 0;
  for (size_t t = 0; t < map.validity.size(); ++t) {
    if (!atlas.owner[t]) continue;
    if (atlas.owner[t] == 4) {
      EXPECT_EQ(map.validity[t], Validity::kEmpty);
      EXPECT_EQ(map.planes.data[0][t], 0);
      ++alone;
    } else {
      ASSERT_TRUE(is_set(map.validity[t])) << t;
      // Of the same height, but where rings come in from beyond the end of the seam: up to three texels.
      EXPECT_NEAR(map.planes.data[0][t], before.planes.data[0][t], 3.0 / 8) << t;
    }
  }
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_GT(figures[0].value, 2 * alone);
  EXPECT_EQ(figures[1].value, alone);
}

TEST(SeamSolve, TheStageSaysWhenThereIsNothingToDo) {
  Pieces p;
  p.add(panel(1, 1, 1, 1), moved({0, 0, 0}));
  const Atlas atlas = packed(p.scene, 8);
  Lightmap map = field_map(p.scene, atlas, [](const DVec3& q, const Vec3&) { return noise(q) + 2; });
  const Lightmap before = map;
  const Figures figures = join_seams(map, PostContext{p.scene, atlas, {}});
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].value, 0);
  EXPECT_EQ(map.planes.data, before.planes.data);
}

TEST(SeamSolve, OffLeavesTheMap) {
  Wall w;
  Lightmap map = field_map(w.scene, w.atlas, [](const DVec3& q, const Vec3&) { return noise(q) + 2; });
  const Lightmap before = map;
  BakeSettings settings;
  settings.seams = false;
  EXPECT_TRUE(join_seams(map, PostContext{w.scene, w.atlas, settings}).empty());
  EXPECT_EQ(map.planes.data, before.planes.data);
}

// Three parts, one without a target; against a dense solve.
LeastSquares small_problem(uint64_t seed) {
  Random random(seed);
  LeastSquares p;
  p.diagonal.resize(30);
  for (double& d : p.diagonal) d = 0.1 + random.next();
  for (uint32_t i = 0; i + 1 < 30; ++i)
    if (i % 10 != 9) p.links.push_back({i, i + 1, 1.0});
  for (uint32_t r = 0; r < 24; ++r) {
    LeastSquares::Row row;
    row.weight = 1000 * random.next();
    for (uint32_t k = 0; k < 5; ++k) {
      row.unknown[k] = 10 * (r % 3) + random.below(10);
      row.factor[k] = static_cast<float>(random.next() - 0.5);
    }
    row.count = 5;
    p.rows.push_back(row);
  }
  return p;
}

TEST(SeamSolve, AgreesWithADenseSolveByFactorAndByGradients) {
  const LeastSquares p = small_problem(3);
  std::vector<std::vector<double>> targets(2, std::vector<double>(p.rows.size(), 0.0));
  for (size_t r = 0; r < p.rows.size(); ++r)
    if (r % 3 != 2) targets[0][r] = 1.0 + static_cast<double>(r), targets[1][r] = -0.5;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(30, 30), b = Eigen::MatrixXd::Zero(30, 2);
  for (int i = 0; i < 30; ++i) a(i, i) = p.diagonal[static_cast<size_t>(i)];
  for (const LeastSquares::Link& l : p.links)
    a(l.a, l.a) += 1, a(l.b, l.b) += 1, a(l.a, l.b) -= 1, a(l.b, l.a) -= 1;
  for (size_t r = 0; r < p.rows.size(); ++r)
    for (uint32_t i = 0; i < 5; ++i) {
      for (uint32_t j = 0; j < 5; ++j)
        a(p.rows[r].unknown[i], p.rows[r].unknown[j]) +=
            p.rows[r].weight * double{p.rows[r].factor[i]} * double{p.rows[r].factor[j]};
      for (int s = 0; s < 2; ++s)
        b(p.rows[r].unknown[i], s) -= p.rows[r].weight * double{p.rows[r].factor[i]} * targets[size_t(s)][r];
    }
  const Eigen::MatrixXd truth = a.fullPivLu().solve(b);
  for (const uint32_t most_factored : {1000u, 0u}) {
    const Solution s = solve(p, targets, {}, {.most_factored = most_factored});
    EXPECT_EQ(s.components, 3u);
    EXPECT_LT(s.residual, 1e-8);
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i < 30; ++i) {
        // Conjugate gradients stop at a residual of 1e-8; the smallest eigenvalue is above 0.1.
        EXPECT_NEAR(s.corrections[size_t(k)][size_t(i)], truth(i, k), 1e-7 * b.norm()) << i;
        if (i >= 20) EXPECT_EQ(s.corrections[size_t(k)][size_t(i)], 0.0);
      }
  }
}

// The least within limits, found by projected gradients in steps too short to miss it.
std::vector<double> least_within(const LeastSquares& p, const std::vector<double>& target, double limit) {
  std::vector<double> c(p.diagonal.size(), 0.0);
  for (int step = 0; step < 400'000; ++step) {
    std::vector<double> slope(c.size());
    for (size_t i = 0; i < c.size(); ++i) slope[i] = p.diagonal[i] * c[i];
    for (const LeastSquares::Link& l : p.links) {
      slope[l.a] += l.weight * (c[l.a] - c[l.b]);
      slope[l.b] -= l.weight * (c[l.a] - c[l.b]);
    }
    for (size_t r = 0; r < p.rows.size(); ++r) {
      double sum = target[r];
      for (uint32_t k = 0; k < p.rows[r].count; ++k)
        sum += double{p.rows[r].factor[k]} * c[p.rows[r].unknown[k]];
      for (uint32_t k = 0; k < p.rows[r].count; ++k)
        slope[p.rows[r].unknown[k]] += p.rows[r].weight * double{p.rows[r].factor[k]} * sum;
    }
    for (size_t i = 0; i < c.size(); ++i) c[i] = std::clamp(c[i] - 1e-4 * slope[i], -limit, limit);
  }
  return c;
}

double cost(const LeastSquares& p, const std::vector<double>& target, const std::vector<double>& c) {
  double sum = 0;
  for (size_t i = 0; i < c.size(); ++i) sum += p.diagonal[i] * c[i] * c[i];
  for (const LeastSquares::Link& l : p.links) sum += l.weight * (c[l.a] - c[l.b]) * (c[l.a] - c[l.b]);
  for (size_t r = 0; r < p.rows.size(); ++r) {
    double step = target[r];
    for (uint32_t k = 0; k < p.rows[r].count; ++k)
      step += double{p.rows[r].factor[k]} * c[p.rows[r].unknown[k]];
    sum += p.rows[r].weight * step * step;
  }
  return sum;
}

TEST(SeamSolve, FindsTheLeastWithinLimitsAndNeverLeavesThem) {
  const LeastSquares p = small_problem(7);
  const std::vector<std::vector<double>> targets(1, std::vector<double>(p.rows.size(), 1.0));
  const std::vector<double> free = solve(p, targets).corrections[0];
  const double limit = 0.3 * std::abs(*std::max_element(free.begin(), free.end(), [](double a, double b) {
                         return std::abs(a) < std::abs(b);
                       }));
  const std::vector<double> truth = least_within(p, targets[0], limit);
  EXPECT_NE(free, truth);
  for (const uint32_t rounds : {1u, 24u, 2000u}) {
    SolveLimits limits;
    limits.low.assign(1, std::vector<double>(free.size(), -limit));
    limits.high.assign(1, std::vector<double>(free.size(), limit));
    limits.rounds = rounds;
    const std::vector<double> c = solve(p, targets, limits).corrections[0];
    for (size_t i = 0; i < c.size(); ++i) EXPECT_LE(std::abs(c[i]), limit);
    const double zero = cost(p, targets[0], std::vector<double>(c.size(), 0.0)),
                 least = cost(p, targets[0], truth);
    const double left = (cost(p, targets[0], c) - least) / (zero - least);
    if (rounds == 24) EXPECT_LT(left, 0.02);
    if (rounds == 2000) EXPECT_LT(left, 1e-6);
  }
}

}  // namespace
}  // namespace kiln

// Which charts collapse, on moments made up here: light of any shape, with noise of a known size.
#include "coordinator/bake/collapse/judge.h"

#include <cmath>

#include "tests/atlas/shapes.h"

namespace kiln {
namespace {

constexpr uint32_t kSide = 32, kShL1Planes = 15;
const BasisInfo& sh_l1() {
  return basis_roster()[*find_basis("sh_l1")];
}

// Square charts of kSide x kSide texels in rows; `light` is E of a texel of a chart, `noise` the standard
// deviation of one replicate's mean, relative to 1.
class Moments {
 public:
  void add(const std::function<double(uint32_t x, uint32_t y)>& light, double noise,
           const std::function<Vec3(uint32_t x, uint32_t y)>& direction = {},
           uint32_t texels = kSide * kSide) {
    ++charts_;
    for (uint32_t i = 0; i < texels; ++i) {
      const uint32_t x = i % kSide, y = i / kSide;
      const double e = light(x, y);
      const Vec3 d = direction ? direction(x, y) : Vec3(0, 0.3f, 0);
      chart_.push_back(charts_);
      s_.samples.push_back(16);
      s_.known.push_back(1);
      s_.variance.push_back(static_cast<float>(16 * noise * noise));
      for (uint32_t r = 0; r < kReplicates; ++r) {
        const double n = e > 0 ? noise * normal() : 0;
        const auto lit = static_cast<float>(e + n);
        s_.luminance[r].push_back(lit);
        for (uint32_t c = 0; c < 3; ++c) s_.mean[r].push_back(lit);
        for (uint32_t f = 0; f < 4; ++f) {
          const double own = e > 0 ? noise * normal() : 0;
          const double share = f == 0 ? 1.0 : double{d[static_cast<int>(f - 1)]};
          for (uint32_t c = 0; c < 3; ++c)
            s_.mean[r].push_back(static_cast<float>((e * share + (f == 0 ? own : 0.5 * own)) / double{kPi}));
        }
      }
    }
    s_.sites = chart_.size();
    s_.planes = kShL1Planes;
  }
  std::vector<ChartLight> judge(double error = 0.05) const {
    return judge_charts(s_, chart_, charts_, {error, 1.96, even_bands(sh_l1())});
  }
  TexelStatistics& statistics() { return s_; }

 private:
  double normal() {
    return std::sqrt(-2 * std::log(1 - random_.next())) * std::cos(2 * double{kPi} * random_.next());
  }
  test::Random random_{7};
  TexelStatistics s_;
  std::vector<uint32_t> chart_;
  uint32_t charts_ = 0;
};

constexpr double kNoise = 0.02;

TEST(JudgeCharts, TheSameLightEverywhereCollapsesWhateverTheNoiseShows) {
  Moments m;
  for (int i = 0; i < 20; ++i) m.add([](uint32_t, uint32_t) { return 1.0; }, kNoise);
  m.add([](uint32_t, uint32_t) { return 1.0; }, 0);
  for (const ChartLight& chart : m.judge()) {
    EXPECT_EQ(chart.why, kEvenlyLit);
    ASSERT_EQ(chart.deviation.size(), 3u) << "E, L0, L1";
    EXPECT_LE(chart.deviation[0], 0.05 / 1.96 * std::sqrt(0.5));
  }
  EXPECT_EQ(m.judge().back().deviation[0], 0) << "without noise nothing is left to be unsure of";
}

TEST(JudgeCharts, WhatIsStatedCoversWhatTheLightDiffersBy) {
  // A ramp that one value still shows: its root mean square is known to the test alone.
  constexpr double kRamp = 0.02;
  const auto ramp = [&](uint32_t x, uint32_t) { return 1 + kRamp * (2.0 * x / (kSide - 1) - 1); };
  Moments m;
  for (int i = 0; i < 50; ++i) m.add(ramp, 0.01);
  double squares = 0;
  for (uint32_t x = 0; x < kSide; ++x) squares += std::pow(ramp(x, 0) - 1, 2) / kSide;
  for (const ChartLight& chart : m.judge()) {
    ASSERT_EQ(chart.why, kEvenlyLit);
    EXPECT_GE(chart.deviation[0], std::sqrt(squares));
  }
}

TEST(JudgeCharts, NoiseThatHidesWhatIsThereKeepsTheTexels) {
  Moments m;
  m.add([](uint32_t, uint32_t) { return 1.0; }, 0.3);
  EXPECT_EQ(m.judge()[0].why, kNotCollapsed);
}

TEST(JudgeCharts, ARampBeyondTheErrorIsKeptAndOneWithinIsNot) {
  for (const double noise : {0.0, 0.01, kNoise}) {
    Moments m;
    const auto ramp = [](double a) {
      return [a](uint32_t x, uint32_t) { return 1 + a * (2.0 * x / (kSide - 1) - 1); };
    };
    m.add(ramp(0.06), noise);
    m.add(ramp(0.3), noise);
    m.add(ramp(0.01), noise);
    const std::vector<ChartLight> charts = m.judge();
    EXPECT_EQ(charts[0].why, kNotCollapsed) << noise;
    EXPECT_EQ(charts[1].why, kNotCollapsed) << noise;
    EXPECT_EQ(charts[2].why, kEvenlyLit) << noise;
    EXPECT_EQ(m.judge(0.2)[0].why, kEvenlyLit) << "of an error of 20 % it is a small part";
  }
}

TEST(JudgeCharts, ALittleShadowInALargeChartIsKept) {
  // Of 1024 texels; over the chart as a whole none of them is much.
  struct Shadow {
    uint32_t size;
    double depth;
  };
  for (const Shadow& shadow : {Shadow{1, 0.5}, Shadow{2, 0.3}, Shadow{4, 0.15}}) {
    Moments m;
    for (uint32_t at = 0; at + shadow.size <= kSide; at += 9)
      m.add([&](uint32_t x,
                uint32_t y) { return x - at < shadow.size && y - at < shadow.size ? 1 - shadow.depth : 1.0; },
            0.01);
    for (const ChartLight& chart : m.judge()) EXPECT_EQ(chart.why, kNotCollapsed) << shadow.size;
  }
}

TEST(JudgeCharts, LightThatTurnsIsKept) {
  // E is the same; where it comes from is not.
  Moments m;
  m.add([](uint32_t, uint32_t) { return 1.0; }, 0.005,
        [](uint32_t x, uint32_t) { return x < kSide / 2 ? Vec3(0.2f, 0.3f, 0) : Vec3(-0.2f, 0.3f, 0); });
  EXPECT_EQ(m.judge()[0].why, kNotCollapsed);
}

TEST(JudgeCharts, AColourThatChangesIsKept) {
  Moments m;
  m.add([](uint32_t, uint32_t) { return 1.0; }, 0);
  TexelStatistics& s = m.statistics();
  for (auto& mean : s.mean)
    for (size_t site = 0; site < s.sites / 2; ++site) mean[site * s.planes + 2] *= 0.8f;  // blue: 1.4 % of E
  EXPECT_EQ(m.judge()[0].why, kNotCollapsed);
}

TEST(JudgeCharts, WhatMetNoLightIsBlack) {
  Moments m;
  m.add([](uint32_t, uint32_t) { return 0.0; }, 0);
  EXPECT_EQ(m.judge()[0].why, kUnlit);
}

TEST(JudgeCharts, AFewLitTexelsInTheDarkAreKept) {
  Moments m;
  m.add([](uint32_t x, uint32_t y) { return x == 5 && y == 9 ? 0.001 : 0.0; }, 0);
  m.add([](uint32_t x, uint32_t y) { return x < 2 && y < 2 ? 1.0 : 0.0; }, 0.1);
  for (const ChartLight& chart : m.judge()) EXPECT_EQ(chart.why, kNotCollapsed);
}

TEST(JudgeCharts, ChartsOfWhichLittleIsKnownAreKept) {
  Moments m;
  const auto lit = [](uint32_t, uint32_t) { return 1.0; };
  const auto dark = [](uint32_t, uint32_t) { return 0.0; };
  m.add(lit, 0, {}, 1);
  m.add(dark, 0, {}, 1);
  m.add(lit, kNoise, {}, kMinEven - 1);
  m.add(dark, 0, {}, kMinBlackSamples / 32 - 1);
  for (const ChartLight& chart : m.judge()) EXPECT_EQ(chart.why, kNotCollapsed);
}

TEST(JudgeCharts, ATexelThatWasNotSampledKeepsItsChartAndOneInsideGeometryDoesNot) {
  Moments m;
  m.add([](uint32_t, uint32_t) { return 1.0; }, kNoise);
  m.add([](uint32_t, uint32_t) { return 1.0; }, kNoise);
  TexelStatistics& s = m.statistics();
  s.known[17] = 0;
  s.known[kSide * kSide + 17] = 0;
  s.samples[kSide * kSide + 17] = 0;
  EXPECT_EQ(m.judge()[0].why, kEvenlyLit);
  EXPECT_EQ(m.judge()[1].why, kNotCollapsed);
}

}  // namespace
}  // namespace kiln

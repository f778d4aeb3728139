#include "coordinator/bake/sampling/allocation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/job/unit.h"

namespace kiln {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr uint32_t kAny = 1u << 30;  // samples: no bound

// Texels whose mean of n samples has the error sigma / sqrt(n).
struct Texels {
  std::vector<float> mean, error;
  std::vector<uint32_t> samples;
  Texels& add(float m, double sigma, uint32_t n) {
    mean.push_back(m);
    error.push_back(static_cast<float>(sigma / std::sqrt(n)));
    samples.push_back(n);
    return *this;
  }
  SampleState state() const { return {mean, error, samples}; }
};

Texels three() {
  return Texels().add(2, 1, 100).add(1, 3, 64).add(0.01f, 0.02, 400);
}

// The same texels once they have what they need.
SampleState with(const SampleState& s, const std::vector<double>& needed, std::vector<float>& error) {
  error.resize(needed.size());
  for (size_t i = 0; i < needed.size(); ++i)
    error[i] = static_cast<float>(s.standard_error[i] * std::sqrt(s.samples[i] / needed[i]));
  return {s.mean, error, s.samples};
}

TEST(Allocation, EveryTexelWithinItsOwnMean) {
  const Texels t = three();
  const double e = 0.03, z = 1.96, k = z * z / (e * e);
  const auto needed = needed_samples(t.state(), ErrorNorm::kMax, e, z);
  const double sigma[] = {1, 3, 0.02}, mean[] = {2, 1, 0.01};
  for (size_t i = 0; i < 3; ++i) {
    const double closed = k * sigma[i] * sigma[i] / (mean[i] * mean[i]);
    EXPECT_NEAR(needed[i], closed, 1e-5 * closed) << i;
  }
}

TEST(Allocation, PerceptualMeasuresTheDarkByTheMap) {
  const Texels t = three();
  const double e = 0.03, z = 1.96, k = z * z / (e * e), floor = kDarkest * (2 + 1 + 0.01) / 3;
  const auto needed = needed_samples(t.state(), ErrorNorm::kPerceptual, e, z);
  EXPECT_NEAR(needed[0], k / 4, 1e-5 * k);
  EXPECT_NEAR(needed[1], k * 9, 1e-4 * k);
  EXPECT_NEAR(needed[2], k * 0.0004 / (floor * floor), 1e-5 * k);
}

TEST(Allocation, OneBlackTexelDoesNotAskForAll) {
  // As good as black, and nothing is known of it: relative to itself its error is a thousandfold.
  Texels t;
  for (int i = 0; i < 99; ++i) t.add(1, 1, 64);
  t.add(1e-6f, 1e-2, 64);
  const double e = 0.05, z = 1.96, alone = z * z / (e * e);  // of the others, by themselves
  const auto needed = needed_samples(t.state(), ErrorNorm::kMeanSquare, e, z);
  // At the most it counts with the deviation 1e-2 / kBlack of a mean of one.
  EXPECT_LE(needed[0], alone * (99 + 1.02) / 100);
  EXPECT_LE(needed[99], 1.02 * alone * 1.02);
}

// Light is not negative: what a texel as good as black states beyond the least mean that counts is no error
// that it can have. One of three times that mean can err by three times what counts.
TEST(Allocation, NoTexelErrsByMoreThanItsLightAllows) {
  const auto reached = [](float mean, double sigma) {
    Texels t;
    for (int i = 0; i < 99; ++i) t.add(1, 0, 64);
    t.add(mean, sigma * 8, 64);
    return reached_error(t.state(), ErrorNorm::kMeanSquare, 1);
  };
  const double floor = kBlack * 0.99;  // nearly
  EXPECT_NEAR(reached(1e-6f, 0.5 * floor), 0.5 / 10, 1e-3);
  EXPECT_NEAR(reached(1e-6f, 30 * floor), 1.0 / 10, 1e-6);
  EXPECT_NEAR(reached(static_cast<float>(3 * floor), 30 * floor), 3.0 / 10, 1e-3);
  Texels t;
  for (int i = 0; i < 99; ++i) t.add(1, 1, 64);
  t.add(1e-6f, 8 * 30 * floor, 64);
  EXPECT_NEAR(planned_deviations(t.state(), std::vector<uint32_t>(100))[98], (8 * 1 + 8) / 9.0, 1e-5);
}

TEST(Allocation, AskedErrorIsReachedInEveryNorm) {
  const Texels t = three();
  for (const ErrorNorm norm : {ErrorNorm::kMax, ErrorNorm::kMeanSquare, ErrorNorm::kPerceptual}) {
    std::vector<float> error;
    const auto needed = needed_samples(t.state(), norm, 0.03, 1.96);
    EXPECT_NEAR(reached_error(with(t.state(), needed, error), norm, 1.96), 0.03, 1e-6);
  }
}

TEST(Allocation, CountsArePlannedByTheTexelsAround) {
  Texels t;
  std::vector<uint32_t> chart;
  for (int i = 0; i < 40; ++i) {
    t.add(1, 1, 64);
    chart.push_back(i < 20 ? 0 : 1);
  }
  chart.push_back(2);  // alone
  t.add(1, 5, 64);
  const auto before = planned_deviations(t.state(), chart);
  for (int i = 0; i < 40; ++i) EXPECT_NEAR(before[i], 1, 1e-6) << i;
  EXPECT_NEAR(before[40], 5, 1e-5);
  t.error[10] *= 1.9f;
  auto after = planned_deviations(t.state(), chart);
  EXPECT_EQ(after[10], before[10]) << "its own says nothing";
  EXPECT_NEAR(after[11], (15 + 1.9) / 16, 1e-5);
  EXPECT_EQ(after[1], before[1]) << "out of reach";
  t.error[10] *= 10;
  after = planned_deviations(t.state(), chart);
  EXPECT_NEAR(after[10], 19 / kStandsOut, 1e-4) << "unless it stands out";
  t.error[21] *= 10;
  EXPECT_EQ(planned_deviations(t.state(), chart)[19], after[19]) << "of another chart";

  SampleState planned = t.state();
  planned.planned = after;
  std::vector<float> error;
  const auto needed = needed_samples(planned, ErrorNorm::kMeanSquare, 0.03, 1.96);
  EXPECT_NEAR(reached_error(with(t.state(), needed, error), ErrorNorm::kMeanSquare, 1.96), 0.03, 1e-6);
  EXPECT_NEAR(needed[10] / needed[30], after[10] / after[30], 1e-5);
  const double missing = missing_samples(needed, t.state(), kAny);
  EXPECT_NEAR(affordable_error(planned, ErrorNorm::kMeanSquare, 0, 1.96, kAny, missing), 0.03, 3e-6);
}

// Light that one sample in 64 meets, so that a third of the texels miss it at first and none stands out by
// more than kStandsOut: the mean over texels that get more samples by the errors of the first.
TEST(Allocation, RareLightIsNotLostToTheChoiceOfTexels) {
  constexpr size_t kTexels = 40'000;
  constexpr uint32_t kFirst = 64;
  constexpr double kRare = 1.0 / 64, kBright = 20, kTruth = 1 + kRare * kBright;
  const std::vector<uint32_t> chart(kTexels, 0);
  const auto lost = [&](bool by_surroundings) {
    std::mt19937_64 random(7);
    const auto number = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    const auto sample = [&] { return 2 * number() + (number() < kRare ? kBright : 0); };
    Texels t;
    std::vector<double> sums(kTexels, 0.0);
    for (double& sum : sums) {
      double squares = 0;
      for (uint32_t k = 0; k < kFirst; ++k) {
        const double v = sample();
        sum += v;
        squares += v * v;
      }
      const double mean = sum / kFirst;
      t.add(static_cast<float>(mean), std::sqrt((squares / kFirst - mean * mean) * kFirst / (kFirst - 1)),
            kFirst);
    }
    SampleState state = t.state();
    std::vector<float> planned;
    if (by_surroundings) planned = planned_deviations(state, chart);
    state.planned = planned;
    const auto needed = needed_samples(state, ErrorNorm::kMeanSquare, 0.4, 1.96);
    double light = 0;
    for (size_t i = 0; i < kTexels; ++i) {
      const auto count = std::clamp(static_cast<uint32_t>(needed[i]), kFirst, 4 * kFirst);
      for (uint32_t k = kFirst; k < count; ++k) sums[i] += sample();
      light += sums[i] / count;
    }
    return 1 - light / kTexels / kTruth;
  };
  // Of the mean over all first samples; the map's has more of them.
  const double deviation = std::sqrt(1.0 / 3 + kRare * (1 - kRare) * kBright * kBright),
               scatter = deviation / std::sqrt(double{kFirst} * kTexels) / kTruth;
  EXPECT_GT(lost(false), 8 * scatter) << "by a texel's own samples light is lost";
  EXPECT_NEAR(lost(true), 0, 4 * scatter);
}

TEST(Allocation, MeanSquareTakesTheFewestSamples) {
  // By search over a grid of allocations that reach the asked-for error: n_0 and n_1 free, n_2 then follows.
  const Texels t = Texels().add(2, 1, 100).add(1, 3, 100).add(0.5f, 0.4, 100);
  const double e = 0.05, z = 1.96, d[] = {0.5, 3, 0.8};
  const auto needed = needed_samples(t.state(), ErrorNorm::kMeanSquare, e, z);
  const double total = needed[0] + needed[1] + needed[2];
  const double allowed = 3 * (e / z) * (e / z);  // sum of d^2 / n
  double least = std::numeric_limits<double>::infinity();
  for (double a = 0.002; a < 1; a += 0.002)
    for (double b = 0.002; a + b < 1; b += 0.002)
      least = std::min(least, (d[0] * d[0] / a + d[1] * d[1] / b + d[2] * d[2] / (1 - a - b)) / allowed);
  EXPECT_LE(total, least * (1 + 1e-5));
  EXPECT_GE(total, least * (1 - 1e-3));  // the grid's own coarseness
}

TEST(Allocation, AffordableErrorIsTheInverseOfMissingSamples) {
  const Texels t = three();
  for (const ErrorNorm norm : {ErrorNorm::kMax, ErrorNorm::kMeanSquare, ErrorNorm::kPerceptual})
    for (const uint32_t most : {kAny, 5000u})
      for (const double fall : {1.0, 0.7})
        for (const double e : {0.2, 0.05, 0.01}) {
          const auto missing =
              missing_samples(needed_samples(t.state(), norm, e, 1.96, fall), t.state(), most);
          if (missing == 0 || missing == kReplicates * (3.0 * most - 564)) continue;  // many errors cost that
          EXPECT_NEAR(affordable_error(t.state(), norm, 0, 1.96, most, missing, fall), e, 1e-4 * e)
              << static_cast<int>(norm) << " " << most;
          EXPECT_DOUBLE_EQ(affordable_error(t.state(), norm, 2 * e, 1.96, most, missing, fall), 2 * e)
              << "no less than is asked for";
        }
}

TEST(Allocation, WithoutSamplesToSpendTheErrorIsWhatIsReached) {
  const Texels t = three();
  const double reached = reached_error(t.state(), ErrorNorm::kMax, 1.96);
  EXPECT_NEAR(affordable_error(t.state(), ErrorNorm::kMax, 0.001, 1.96, kAny, 0), reached, 1e-9);
}

TEST(Allocation, NoTexelGetsMoreThanTheMost) {
  const Texels t = Texels().add(1, 1, 100).add(1, 1, 1000);
  const std::vector<double> needed = {5000, 5000};
  EXPECT_DOUBLE_EQ(missing_samples(needed, t.state(), kAny), kReplicates * (4900 + 4000));
  EXPECT_DOUBLE_EQ(missing_samples(needed, t.state(), 600), kReplicates * 500);
  const std::vector<double> enough = {50, 1000};
  EXPECT_DOUBLE_EQ(missing_samples(enough, t.state(), kAny), 0);
}

TEST(Allocation, BlackAndUnknownTexelsNeedNothing) {
  Texels lit = three(), all = three();
  all.add(0, 0, 50);    // black
  all.add(0, 0.1, 50);  // has errors but no light
  all.add(1, 1, 50);    // its error is not known
  all.error.back() = kInfinite;
  all.mean.push_back(1);  // no sample
  all.error.push_back(kInfinite);
  all.samples.push_back(0);
  all.mean.push_back(1);  // no sample either, whatever its error says
  all.error.push_back(1);
  all.samples.push_back(0);
  for (const ErrorNorm norm : {ErrorNorm::kMax, ErrorNorm::kMeanSquare, ErrorNorm::kPerceptual}) {
    const auto alone = needed_samples(lit.state(), norm, 0.03, 1.96);
    const auto needed = needed_samples(all.state(), norm, 0.03, 1.96);
    for (size_t i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(needed[i], alone[i]);
    for (size_t i = 3; i < 8; ++i) EXPECT_EQ(needed[i], all.samples[i]) << i;
    EXPECT_DOUBLE_EQ(reached_error(all.state(), norm, 1.96), reached_error(lit.state(), norm, 1.96));
  }
}

TEST(Allocation, WhatPartOfTheSquaredErrorIsThatOfSomeSites) {
  Texels t;
  t.add(1, 1, 100).add(2, 6, 100).add(0, 0, 50);  // relative errors 0.1 and 0.3, and none met
  const SiteSamples first{0, {100, 10}}, second{1, {100, 10}}, third{2, {50, 10}};
  const auto share = [&](const std::vector<SiteSamples>& work, double unmet) {
    return error_share(t.state(), work, unmet);
  };
  EXPECT_NEAR(share({first}, 0), 0.1, 1e-6);
  EXPECT_NEAR(share({first, second}, 0), 1, 1e-6);
  EXPECT_EQ(share({third}, 0), 0);
  EXPECT_EQ(share({}, 0), 0);
  constexpr double kUnmet = 0.01;
  const double all = std::pow(reached_error(t.state(), ErrorNorm::kMeanSquare, 1, kUnmet), 2) * 2;
  EXPECT_NEAR(share({second}, kUnmet), 0.09 / all, 1e-6);
  EXPECT_NEAR(share({third}, kUnmet), 1 - 0.1 / all, 1e-6);
  EXPECT_EQ(error_share(Texels().state(), {}), 0);
}

TEST(Allocation, APassIsVainIfTheOthersHaveTooMuchOfTheError) {
  Texels t;
  t.add(1, 1, 100).add(1, 0.05, 100);  // relative errors 0.1 and 0.005
  const std::vector<SiteSamples> most = {{0, {100, 10}}}, least = {{1, {100, 10}}};
  const double others = 0.1 / std::sqrt(2);
  const auto vain = [&](const std::vector<SiteSamples>& work, double asked,
                        ErrorNorm norm = ErrorNorm::kMeanSquare) {
    return is_vain(work, t.state(), norm, asked, 1);
  };
  EXPECT_TRUE(vain(least, 0.99 * others));
  EXPECT_FALSE(vain(least, 1.01 * others)) << "without the error of these it is reached";
  EXPECT_FALSE(vain(most, 0.001)) << "these have most of the error";
  EXPECT_FALSE(vain(least, 0)) << "a bake without a target uses its time";
  EXPECT_FALSE(vain({}, 0.99 * others));
  EXPECT_FALSE(vain(least, 0.001, ErrorNorm::kMax)) << "every texel counts";
}

// Texels that met no light get what lowers the sum of squares as much for a sample as elsewhere: they are as
// lit ones of that variance.
TEST(Allocation, TexelsThatMetNoLightGetSamplesToo) {
  Texels t = three();
  t.add(0, 0, 50).add(1e-9f, 1e-9, 50).add(0, 0, 50);
  t.error.back() = kInfinite;  // inside geometry
  constexpr double kUnmet = 0.09, kError = 0.04, kZ = 1.96;
  const auto without = needed_samples(t.state(), ErrorNorm::kMeanSquare, kError, kZ),
             needed = needed_samples(t.state(), ErrorNorm::kMeanSquare, kError, kZ, 1, kUnmet);
  const double deviation = 1.0 / 2, slope = deviation / needed[0];  // of the first: (deviation / n)^2
  EXPECT_NEAR(needed[3], std::sqrt(kUnmet) / slope, 1e-4 * needed[3]);
  EXPECT_GT(needed[3], 50);
  EXPECT_DOUBLE_EQ(needed[4], needed[3]);  // as good as none
  EXPECT_EQ(needed[5], 50);
  EXPECT_EQ(without[3], 50);
  // The others get more, for the error that is left in those. All that it is asked for is what is reached.
  for (size_t i = 0; i < 3; ++i) EXPECT_GT(needed[i], without[i]);
  EXPECT_GT(reached_error(t.state(), ErrorNorm::kMeanSquare, kZ, kUnmet),
            reached_error(t.state(), ErrorNorm::kMeanSquare, kZ));
  std::vector<float> error;
  SampleState then = with(t.state(), needed, error);
  const std::vector<uint32_t> counts(needed.begin(), needed.end());
  then.samples = counts;
  EXPECT_NEAR(reached_error(then, ErrorNorm::kMeanSquare, kZ, kUnmet), kError, 0.01 * kError);
  // Other norms ask nothing of what has no light.
  for (const ErrorNorm norm : {ErrorNorm::kMax, ErrorNorm::kPerceptual})
    EXPECT_EQ(needed_samples(t.state(), norm, kError, kZ, 1, kUnmet)[3], 50);
}

// What sites that met no light may have missed is stated: the same that the norm counts them with.
TEST(Allocation, TexelsThatMetNoLightStateWhatTheyMayHaveMissed) {
  Texels t = three();
  t.add(0, 0, 50).add(1e-9f, 1e-9, 400).add(1e-9f, 1e-9, 50).add(0, 0, 1).add(0, 0, 50);
  t.error.back() = kInfinite;  // inside geometry
  std::vector<float> measured(t.mean.size(), 0.0f);
  for (const size_t i : {0, 1, 2}) measured[i] = t.mean[i];
  const double floor = least_mean(t.state(), ErrorNorm::kMeanSquare);
  measured[5] = static_cast<float>(0.01 * floor);  // its own samples have met light that a filter took away
  SampleState state = t.state();
  state.measured = measured;
  constexpr double kUnmet = 2;
  const std::vector<float> missed = unmet_errors(state, kUnmet);
  for (const size_t i : {0, 1, 2}) EXPECT_EQ(missed[i], 0) << "it is lit";
  EXPECT_NEAR(missed[3], floor * std::sqrt(kUnmet / 50), 1e-5 * missed[3]);
  EXPECT_NEAR(missed[4], floor * std::sqrt(kUnmet / 400), 1e-5 * missed[4])
      << "all of its light is its neighbours', by a filter";
  EXPECT_EQ(missed[5], 0) << "its own samples have met light, and state its error";
  EXPECT_NEAR(missed[6], floor, 1e-5 * floor) << "no light that is missed counts for more";
  EXPECT_EQ(missed[7], 0);
  // Together with what is stated anyway it is what the norm counts.
  double squares = 0;
  const double counted = std::pow(reached_error(state, ErrorNorm::kMeanSquare, 1, kUnmet), 2) -
                         std::pow(reached_error(state, ErrorNorm::kMeanSquare, 1), 2);
  for (const float m : missed) squares += double{m} * m / (floor * floor);
  EXPECT_NEAR(squares, counted * 5, 1e-6);  // five have a mean
  // Nor does it get samples for what it may have missed.
  const auto needed = needed_samples(state, ErrorNorm::kMeanSquare, 0.09, 1.96, 1, kUnmet),
             as_black = needed_samples(t.state(), ErrorNorm::kMeanSquare, 0.09, 1.96, 1, kUnmet);
  EXPECT_GT(as_black[5], 50);
  EXPECT_LT(needed[5], as_black[5]);
}

// What black sites may have missed of a band is to that of E as errors are where light was met: their own
// samples say nothing of either.
TEST(Allocation, WhatBlackTexelsMayHaveMissedIsStatedOfBandsToo) {
  Texels t;
  t.add(1, 0.3, 50).add(1, 0.4, 50).add(0.5f, 0.1, 50).add(0, 0.02, 50).add(0, 0, 50);
  t.error.back() = kInfinite;
  const std::vector<float> measured = {1, 1, 0, 0, 0};  // a filter has lit the third
  SampleState state = t.state();
  state.measured = measured;
  std::vector<float> band = {0.9f, 1.2f, 1e10f, 1e-9f, 0};
  state_unmet_bands(state, band);
  EXPECT_EQ(std::vector<float>(band.begin(), band.begin() + 2), (std::vector<float>{0.9f, 1.2f}));
  EXPECT_FLOAT_EQ(band[2], 0.3f);  // 3 x 0.1
  EXPECT_FLOAT_EQ(band[3], 0.06f);
  EXPECT_EQ(band[4], 0);
  const Texels dark = Texels().add(0, 0.1, 50).add(0, 0, 50);
  std::vector<float> none = {0, 0};
  state_unmet_bands(dark.state(), none);
  EXPECT_EQ(none, std::vector<float>(2, 0.0f)) << "a map without light";
}

// A texel that a filter has lit has found nothing: its own samples are as black as before. One that a filter
// had lit, and whose samples then meet light, has.
TEST(Allocation, LightThatAFilterTookFromNeighboursIsNotFound) {
  constexpr size_t kSites = 10'000, kLit = 500;
  std::vector<float> none(kSites, 0.0f), error(kSites, 1e-9f);
  none[0] = 1;
  std::vector<float> lit = none;
  for (size_t i = 1; i <= kLit; ++i) lit[i] = 1;
  const std::vector<uint32_t> samples(kSites, 100), more(kSites, 200);
  const auto learn = [&](std::span<const float> mean, std::span<const float> measured,
                         std::span<const float> mean_after, std::span<const float> measured_after) {
    UnmetLight learnt;
    learnt.observe({mean, error, samples, {}, measured}, {mean_after, error, more, {}, measured_after});
    return learnt.get();
  };
  const double nothing = learn(none, none, none, none);
  EXPECT_EQ(learn(none, none, lit, none), nothing) << "only a filter has lit them";
  EXPECT_GT(learn(none, none, lit, lit), 5 * nothing);
}

TEST(Allocation, HowMuchLightBlackTexelsHaveIsLearnt) {
  // Black texels with chances of an even density near 0: of n samples meet light all but U / n of the lit
  // ones.
  constexpr size_t kSites = 10'000;
  for (const double variance : {0.1, 1.0}) {
    std::vector<float> mean(kSites, 0.0f), error(kSites, 1e-9f);
    std::vector<uint32_t> samples(kSites, 32);
    mean[0] = 1;  // what light there is
    UnmetLight learnt;
    const auto black = [&] { return static_cast<double>(std::count(mean.begin(), mean.end(), 0.0f)); };
    for (const uint32_t n : {64u, 256u, 1024u}) {
      const std::vector<float> before = mean;
      const std::vector<uint32_t> had = samples;
      auto lit = static_cast<size_t>(std::lround(variance * (1.0 / had[1] - 1.0 / n) * black()));
      for (size_t i = 1; i < kSites; ++i) {
        samples[i] = n;
        if (mean[i] == 0 && lit > 0) mean[i] = 1, --lit;
      }
      learnt.observe({before, error, had}, {mean, error, samples});
    }
    EXPECT_NEAR(learnt.get(), variance, 0.05 * variance);  // a texel of the last 29 and 2.9 is that or more
    const double before = learnt.get();
    learnt.observe({mean, error, samples}, {mean, error, samples});
    EXPECT_EQ(learnt.get(), before);
  }
}

// Of texels that many samples have left black hardly one turns out lit, whatever was found early.
TEST(Allocation, WhatWasLearntOfBlackTexelsAtFewSamplesIsForgotten) {
  constexpr size_t kSites = 10'000;
  std::vector<float> mean(kSites, 0.0f), error(kSites, 1e-9f);
  std::vector<uint32_t> samples(kSites, 16);
  mean[0] = 1;
  UnmetLight learnt;
  const auto pass = [&](uint32_t n, size_t lit) {
    const std::vector<float> before = mean;
    const std::vector<uint32_t> had = samples;
    for (size_t i = 1; i < kSites; ++i) {
      samples[i] = n;
      if (mean[i] == 0 && lit > 0) mean[i] = 1, --lit;
    }
    learnt.observe({before, error, had}, {mean, error, samples});
    return learnt.get();
  };
  EXPECT_NEAR(pass(64, 100), 100 / (10'000 * (1.0 / 16 - 1.0 / 64)), 0.002);
  // With a factor f of samples, the pass before counts f^2 less and was expected to find f times as much:
  // what it found weighs 1 / (1 + f).
  const double first = learnt.get();
  EXPECT_NEAR(pass(256, 0), first / 5, 0.01 * first);
  EXPECT_NEAR(pass(1024, 0), first / 5 / 5, 0.01 * first);
}

// A few texels that grow say little of the others, and what was learnt of all stays.
TEST(Allocation, WhatWasLearntOfBlackTexelsOutlastsTheGrowthOfOne) {
  constexpr size_t kSites = 10'000;
  std::vector<float> mean(kSites, 0.0f), error(kSites, 1e-9f);
  mean[0] = 1;
  std::vector<uint32_t> samples(kSites, 100), more(kSites, 200);
  UnmetLight learnt;
  std::vector<float> lit = mean;
  for (size_t i = 1; i <= 700; ++i) lit[i] = 1;
  learnt.observe({mean, error, samples}, {lit, error, more});
  const double before = learnt.get();
  samples = more;
  more.back() = 800;
  learnt.observe({lit, error, samples}, {lit, error, more});
  EXPECT_NEAR(learnt.get(), before, 0.01 * before);
}

TEST(Allocation, AMapWithoutLightIsDone) {
  const Texels dark = Texels().add(0, 0, 16).add(0, 0, 16);
  for (const ErrorNorm norm : {ErrorNorm::kMax, ErrorNorm::kMeanSquare, ErrorNorm::kPerceptual}) {
    EXPECT_EQ(reached_error(dark.state(), norm, 1.96), 0);
    EXPECT_EQ(reached_error(dark.state(), norm, 1.96, 0.01), 0);
    EXPECT_EQ(missing_samples(needed_samples(dark.state(), norm, 0.01, 1.96, 1, 0.01), dark.state(), kAny),
              0);
    EXPECT_EQ(missing_samples(needed_samples(dark.state(), norm, 0.01, 1.96), dark.state(), kAny), 0);
    EXPECT_DOUBLE_EQ(affordable_error(dark.state(), norm, 0.01, 1.96, kAny, 100), 0.01);
  }
}

TEST(Allocation, SlowFallNeedsMoreSamples) {
  // Errors that fall as n^(-fall / 2): at what is said to be needed, each is what was asked for.
  const Texels t = three();
  const double fall = 0.6, e = 0.03, z = 1.96;
  const auto needed = needed_samples(t.state(), ErrorNorm::kMax, e, z, fall);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_GT(needed[i], t.samples[i]);
    const double error = t.error[i] * std::pow(t.samples[i] / needed[i], fall / 2);
    EXPECT_NEAR(z * error / t.mean[i], e, 1e-6);
  }
  // What is better than asked for is not asked to lose samples.
  const auto few = needed_samples(t.state(), ErrorNorm::kMax, 10, z, fall);
  for (size_t i = 0; i < 3; ++i) EXPECT_LE(few[i], t.samples[i]);
}

TEST(Allocation, FallIsLearntFromPasses) {
  constexpr size_t kSites = 20000;
  const auto state_at = [](uint32_t n, double fall, std::vector<float>& error, std::vector<uint32_t>& samples,
                           const std::vector<float>& mean) {
    error.clear();
    samples.assign(kSites, n);
    for (size_t i = 0; i < kSites; ++i)
      error.push_back(static_cast<float>((1 + i % 7) * std::pow(n, -fall / 2)));
    return SampleState{mean, error, samples};
  };
  const std::vector<float> mean(kSites, 1.0f);
  for (const double fall : {0.5, 0.7, 1.0}) {
    std::vector<float> error[3];
    std::vector<uint32_t> samples[3];
    const SampleState a = state_at(32, fall, error[0], samples[0], mean),
                      b = state_at(128, fall, error[1], samples[1], mean),
                      c = state_at(160, fall, error[2], samples[2], mean);
    ConvergenceRate learnt;
    learnt.observe(a, b);
    EXPECT_NEAR(learnt.get(), fall, 0.005 + 0.5 / 64);
    learnt.observe(b, c);
    EXPECT_NEAR(learnt.get(), fall, 0.005 + 0.5 / 64);
    const double before = learnt.get();
    learnt.observe(c, c);  // no site got more
    EXPECT_EQ(learnt.get(), before);
  }
  // What is not light, or has no error, says nothing.
  ConvergenceRate none;
  const double expected = none.get();
  const Texels dark = Texels().add(0, 1, 10).add(1, 0, 10);
  const Texels more = Texels().add(0, 0.1, 20).add(1, 0, 20);
  none.observe(dark.state(), more.state());
  EXPECT_EQ(none.get(), expected);
}

TEST(Allocation, NormsHaveNames) {
  EXPECT_EQ(*find_error_norm("max"), ErrorNorm::kMax);
  EXPECT_EQ(*find_error_norm("mean-square"), ErrorNorm::kMeanSquare);
  EXPECT_EQ(*find_error_norm("perceptual"), ErrorNorm::kPerceptual);
  EXPECT_FALSE(find_error_norm("worst"));
}

}  // namespace
}  // namespace kiln

// Measures against closed forms.
#include "coordinator/measure/compare/measures.h"

#include <functional>
#include <limits>
#include <random>

#include "coordinator/measure/compare/difference_picture.h"
#include "coordinator/measure/compare/ssim.h"
#include "coordinator/measure/compare/summary.h"

namespace kiln {
namespace {

ErrorMap map_of(std::vector<double> light, std::vector<double> stated = {}) {
  ErrorMap m;
  m.name = "map";
  m.width = 2;
  m.page_height = static_cast<uint32_t>(light.size() / 2);
  m.measured.assign(light.size(), true);
  m.light = std::move(light);
  m.stated = std::move(stated);
  return m;
}

std::vector<double> normal(size_t n, double mean, double sigma, uint32_t seed) {
  std::mt19937 numbers(seed);
  std::normal_distribution<double> normal(mean, sigma);
  std::vector<double> out(n);
  for (double& v : out) v = normal(numbers);
  return out;
}

constexpr size_t kMany = 40000;

TEST(Measures, HalvesByHand) {
  const auto c =
      *compare_maps(map_of({3, 4}), map_of({1, 4}), std::make_unique<ErrorMap>(map_of({2, 6})).get(), {});
  const double floor = 3.25 * 3.25 * 1e-4;  // r = 1.5 and 5
  EXPECT_EQ(c.texels, 2u);
  EXPECT_DOUBLE_EQ(c.bias, 0.25);
  EXPECT_DOUBLE_EQ(c.mse, 1.0);  // (2 x 1 + 0 x -2) / 2
  EXPECT_DOUBLE_EQ(c.rel_mse, 0.5 * 2 / (2.25 + floor));
  EXPECT_DOUBLE_EQ(*c.reference_rel_mse, 0.5 * (0.25 / (2.25 + floor) + 1 / (25 + floor)));
  EXPECT_DOUBLE_EQ(c.bias_error, std::sqrt(0.5 * (0.25 + 1) / 2));
}

TEST(Measures, NoiseOfTheReferenceDropsOut) {
  // One: a error of 0.1 against halves of 0.2. The product's variance is E[x^2] E[y^2] + E[xy]^2.
  const ErrorMap a = map_of(normal(kMany, 10, 0.1, 1)), b1 = map_of(normal(kMany, 10, 0.2, 2)),
                 b2 = map_of(normal(kMany, 10, 0.2, 3));
  const double sigma = std::sqrt((0.05 * 0.05 + 0.01 * 0.01) / kMany);
  const auto halves = *compare_maps(a, b1, &b2, {});
  EXPECT_NEAR(halves.mse, 0.01, 5 * sigma);
  EXPECT_NEAR(compare_maps(a, b1, nullptr, {})->mse, 0.05, 5 * 0.05 * std::sqrt(2.0 / kMany));
  EXPECT_NEAR(halves.rel_mse_error, sigma / 100, 0.1 * sigma / 100);
  EXPECT_NEAR(*halves.reference_rel_mse, 0.02 / 100, 0.02 / 100 * 5 * std::sqrt(2.0 / kMany) + 1e-6);
}

TEST(Measures, TrueStatementsAreCovered) {
  const ErrorMap truth = map_of(std::vector<double>(kMany, 1.0));
  const auto stating = [&](double s) {
    return map_of(normal(kMany, 1, 0.02, 4), std::vector<double>(kMany, s));
  };
  const auto k = *compare_maps(stating(0.02), truth, nullptr, {})->calibration;
  const auto share_error = [](double p) { return 5 * std::sqrt(p * (1 - p) / kMany); };
  EXPECT_NEAR(k.coverage, 0.95, share_error(0.95));
  EXPECT_NEAR(k.error_ratio, 1, 5 * std::sqrt(2.0 / kMany) / 2);
  EXPECT_NEAR(k.stated_rms, 0.02, 0.001);
  EXPECT_NEAR(k.stated_rel_mse, 0.02 * 0.02 / (1 + 1e-4), 1e-12);  // the denominator of relMSE
  EXPECT_EQ(k.promised, kMany);                                    // 1.96 x 0.02 < 0.05
  EXPECT_NEAR(k.promise_kept, std::erf(2.5 / std::sqrt(2.0)), share_error(0.987));
  const auto half = *compare_maps(stating(0.01), truth, nullptr, {})->calibration;
  EXPECT_NEAR(half.coverage, std::erf(0.5 * 1.959964 / std::sqrt(2.0)), share_error(0.67));
  EXPECT_NEAR(half.error_ratio, 2, 5 * std::sqrt(2.0 / kMany));
  EXPECT_EQ(compare_maps(stating(0.2), truth, nullptr, {})->calibration->promised, 0u);
}

TEST(Measures, BlackTexelsPromiseNothing) {
  // Ten texels of which no sample met light state 0 +- 0; two have met next to none. Neither may hide what is
  // said of the other hundred, nor count as right.
  std::vector<double> light(112, 1.0), stated(112, 0.01), truth(112, 1.01);
  for (size_t i = 0; i < 10; ++i) light[i] = stated[i] = 0;
  light[10] = light[11] = 1e-9, stated[10] = stated[11] = 1e-15;
  const auto k = *compare_maps(map_of(light, stated), map_of(truth), nullptr, {})->calibration;
  EXPECT_EQ(k.promised, 102u);
  EXPECT_DOUBLE_EQ(k.largest_stated, 0.01);  // brightest: 1
  EXPECT_DOUBLE_EQ(k.promise_kept, 100.0 / 102);
  EXPECT_NEAR(k.error_ratio, 1, 1e-6);
  EXPECT_NEAR(k.stated_rms, 0.01, 1e-9);
  EXPECT_NEAR(k.stated_rel_mse, 100.0 / 112 * 0.01 * 0.01 / (1.01 * 1.01 * (1 + 1e-4)), 1e-12);
}

// A texel that comes out black errs by the light that it should have had: by 1, relative to that.
TEST(Measures, ABlackTexelStatesNoMoreOfTheMapThanItCanErrBy) {
  std::vector<double> light(100, 1.0), stated(100, 0.0), truth(100, 1.0);
  light[7] = truth[7] = 0, stated[7] = 0.3;
  const auto k = *compare_maps(map_of(light, stated), map_of(truth), nullptr, {})->calibration;
  EXPECT_NEAR(k.stated_rel_mse, 0.01, 1e-9);
  EXPECT_DOUBLE_EQ(k.largest_stated, 0.3);
}

TEST(Measures, TexelsOfUnknownErrorStateNothing) {
  std::vector<double> stated(10, 0.01);
  stated[3] = std::numeric_limits<double>::infinity();
  const auto k = *compare_maps(map_of(std::vector<double>(10, 1.0), stated),
                               map_of(std::vector<double>(10, 1.0)), nullptr, {})
                      ->calibration;
  EXPECT_NEAR(k.stated_rel_mse, 0.01 * 0.01 / (1 + 1e-4), 1e-12);
}

TEST(Measures, TextHasTheStatedRelMseWhereOneIsStated) {
  const ErrorMap truth = map_of(std::vector<double>(10, 1.0));
  const auto text_of = [&](const ErrorMap& a) {
    return comparison_text(*compare_maps(a, truth, nullptr, {}), {});
  };
  EXPECT_NE(text_of(map_of(std::vector<double>(10, 1.0), std::vector<double>(10, 0.1)))
                .find("relMSE   0 +- 0, stated 0.009999\n"),
            std::string::npos);
  EXPECT_EQ(text_of(truth).find("stated"), std::string::npos);
}

TEST(Measures, PercentilesAndWorstTexels) {
  std::vector<double> light(100, 1.0), stated(100, 0.5);
  for (size_t i = 0; i < 100; ++i) light[i] += 0.001 * static_cast<double>(i);
  ErrorMap a = map_of(light, stated), b = map_of(std::vector<double>(100, 1.0));
  a.page_height = b.page_height = 25;
  a.pages = b.pages = 2;
  const auto c = *compare_maps(a, b, nullptr, {0.05, 0.95, 2});
  const double scale = std::sqrt(1 + 1e-4);
  const double expected[] = {0.049, 0.089, 0.094, 0.098, 0.099};
  for (size_t k = 0; k < 5; ++k) EXPECT_NEAR(c.percentiles[k], expected[k] / scale, 1e-12) << k;
  EXPECT_NEAR(c.within, 0.5, 0.0101);  // 0.05 itself is on the edge
  ASSERT_EQ(c.worst.size(), 2u);
  EXPECT_EQ(c.worst[0].x, 1u);
  EXPECT_EQ(c.worst[0].y, 24u);
  EXPECT_EQ(c.worst[0].page, 1u);
  EXPECT_EQ(c.worst[0].stated, 0.5);
}

TEST(Measures, OnlyTexelsMeasuredInAllMapsCount) {
  ErrorMap a = map_of({1, 2, 3, 100}), b = map_of({1, 2, 4, 1}), b2 = map_of({1, 50, 5, 1});
  a.measured[3] = false;
  b2.measured[1] = false;
  EXPECT_EQ(compare_maps(a, b, nullptr, {})->texels, 3u);
  EXPECT_EQ(compare_maps(a, b, &b2, {})->texels, 2u);
  EXPECT_TRUE(std::isnan(relative_differences(a, b, &b2)[1]));
}

TEST(Measures, BlackMapsAreEqual) {
  const ErrorMap black = map_of({0, 0, 0, 0}, {0, 0, 0, 0});
  const auto c = *compare_maps(black, map_of({0, 0, 0, 0}), nullptr, {});
  EXPECT_EQ(c.rel_mse, 0);
  EXPECT_EQ(c.within, 1);
  EXPECT_EQ(c.calibration->coverage, 1);
}

TEST(Measures, WhatCannotBeComparedSaysWhatToDo) {
  const auto message = [](const Expected<Comparison>& c) { return c ? std::string() : c.error().message; };
  const ErrorMap a = map_of({1, 2}), tall = map_of({1, 2, 3, 4});
  EXPECT_NE(message(compare_maps(a, tall, nullptr, {})).find("--keep-layout"), std::string::npos);
  EXPECT_NE(message(compare_maps(a, map_of({1, 3}), &tall, {})).find("2x1 and 2x2"), std::string::npos);
  EXPECT_NE(message(compare_maps(a, a, &a, {})).find("--seed"), std::string::npos);
  ErrorMap none = a;
  none.measured = {false, false};
  EXPECT_NE(message(compare_maps(a, none, nullptr, {})).find("no measured texel"), std::string::npos);
}

TEST(Measures, CsvHasAValueForEveryName) {
  const auto columns = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  for (const ErrorMap& a : {map_of({1, 2}), map_of({1, 2}, {0.1, 0.1})}) {
    const std::string csv = comparison_csv(*compare_maps(a, map_of({1, 3}), nullptr, {}));
    const size_t end = csv.find('\n');
    EXPECT_EQ(columns(csv.substr(0, end)), columns(csv.substr(end)));
  }
}

ErrorMap square(uint32_t side, const std::function<double(uint32_t, uint32_t)>& light) {
  ErrorMap m;
  m.width = m.page_height = side;
  for (uint32_t y = 0; y < side; ++y)
    for (uint32_t x = 0; x < side; ++x) m.light.push_back(light(x, y));
  m.measured.assign(m.light.size(), true);
  return m;
}

// Of a window of one value each only the first factor is left: (2 a b + C1) / (a^2 + b^2 + C1).
TEST(Ssim, OfEvenMapsIsTheClosedForm) {
  const ErrorMap b = square(20, [](auto, auto) { return 2.0; }),
                 a = square(20, [](auto, auto) { return 6.0; });
  EXPECT_NEAR(*structural_similarity(b, b, nullptr), 1, 1e-9);
  const double shown_b = linear_to_srgb(0.5f), shown_a = linear_to_srgb(0.75f);  // 2 / (2 + 2), 6 / (6 + 2)
  const double expected = (2 * shown_a * shown_b + 1e-4) / (shown_a * shown_a + shown_b * shown_b + 1e-4);
  EXPECT_NEAR(*structural_similarity(a, b, nullptr), expected, 1e-6);
}

TEST(Ssim, SeesWhatIsLostAndNotWhereItIsNot) {
  const auto waves = [](double noise) {
    std::mt19937 numbers(3);
    std::normal_distribution<double> normal(0, noise);
    return square(48, [&, normal](uint32_t x, uint32_t y) mutable {
      return 2 + std::sin(0.5 * x) + std::sin(0.4 * y) + (noise > 0 ? normal(numbers) : 0);
    });
  };
  const ErrorMap b = waves(0), even = square(48, [](auto, auto) { return 2.0; });
  const double little = *structural_similarity(waves(0.02), b, nullptr),
               much = *structural_similarity(waves(0.3), b, nullptr);
  EXPECT_GT(little, 0.98);
  EXPECT_LT(much, little - 0.05);
  EXPECT_LT(*structural_similarity(even, b, nullptr), 0.5);
  // The mean of two halves is the reference.
  ErrorMap low = b, high = b;
  for (double& v : low.light) v *= 0.9;
  for (double& v : high.light) v *= 1.1;
  EXPECT_NEAR(*structural_similarity(b, low, &high), 1, 1e-9);
}

// What lies beside a chart on the page lies elsewhere in the world.
TEST(Ssim, WindowsStayInTheirChart) {
  ErrorMap a = square(24, [](uint32_t x, uint32_t) { return x < 12 ? 1.0 : 3.0; });
  for (uint32_t t = 0; t < 24 * 24; ++t) a.chart.push_back(t % 24 < 12 ? 1 : 2);
  ErrorMap b = a;
  for (uint32_t t = 0; t < 24 * 24; ++t)
    if (t % 24 >= 12) b.measured[t] = false;  // of the second chart nothing is compared
  ErrorMap other = b;
  for (uint32_t t = 0; t < 24 * 24; ++t)
    if (t % 24 >= 12) other.light[t] = 1000;
  EXPECT_NEAR(*structural_similarity(a, b, nullptr), 1, 1e-9);
  EXPECT_NEAR(*structural_similarity(a, other, nullptr), 1, 1e-9);
  // Charts of three texels a side have no window.
  ErrorMap small = square(3, [](auto, auto) { return 1.0; });
  EXPECT_FALSE(structural_similarity(small, small, nullptr));
  EXPECT_EQ(touching_texels(b)[0], 1u);
  EXPECT_EQ(touching_texels(b)[13], 0u);
}

TEST(Ssim, TheSmallestBoxHasTheTexel) {
  const ErrorMap m = square(8, [](auto, auto) { return 1.0; });
  const std::vector<uint32_t> labels = chart_labels(m, {{0, 0, 8, 8, 0, 4}, {2, 2, 4, 4, 0, 6}});
  EXPECT_EQ(labels[0], 5u);
  EXPECT_EQ(labels[3 * 8 + 3], 7u);
  EXPECT_EQ(labels[5 * 8 + 5], 5u);
}

TEST(DifferencePicture, RedIsBrighterBlueIsDarker) {
  const ErrorMap layout = map_of({1, 1, 1, 1});
  const Picture p = difference_picture(layout, {0.2, -0.2, 0, std::nan("")});
  const auto at = [&](uint32_t x, uint32_t y, size_t c) { return p.rgb[(size_t{y} * p.width + x) * 3 + c]; };
  const uint32_t far = p.width - 1, low = p.width - 1;  // two texels a side
  EXPECT_GT(at(0, 0, 0), at(0, 0, 2));
  EXPECT_LT(at(far, 0, 0), at(far, 0, 2));
  EXPECT_EQ(at(0, low, 0), 255);
  EXPECT_EQ(at(far, low, 0), at(far, low, 2));
  EXPECT_LT(at(far, low, 0), 128);
}

TEST(DifferencePicture, ScaleIsOneTwoOrFive) {
  for (const auto& [v, up] : {std::pair(0.2, 0.2), std::pair(0.21, 0.5), std::pair(0.51, 1.0),
                              std::pair(1.0, 1.0), std::pair(1.1, 2.0), std::pair(0.0301, 0.05)})
    EXPECT_NEAR(round_up_125(v), up, 1e-12) << v;
}

}  // namespace
}  // namespace kiln

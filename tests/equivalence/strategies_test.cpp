// Estimates of the same light by different means. In each random scene, mean E over the texels by light
// sampling alone, by paths alone, and by both weighted against each other; by the light tree and by
// lights chosen with equal probability. Two estimates agree if
//     |a - b| <= z sqrt(error_a^2 + error_b^2),   z = Phi^-1(1 - p / (2 m)),
// with p = 0.001 for all m comparisons together (Bonferroni). The seeds are fixed: nothing here is luck.
#include <functional>

#include "tests/equivalence/random_scenes.h"
#include "tests/equivalence/ready_scene.h"

namespace kiln {
namespace {

using Estimate = test::ReadyScene::Estimate;

constexpr double kSignificance = 0.001;
constexpr uint32_t kSamples = 512, kStep = 5;

double normal_quantile(double upper_tail) {
  double low = 0, high = 10;
  for (int i = 0; i < 100; ++i) {
    const double z = (low + high) / 2;
    (0.5 * std::erfc(z / std::sqrt(2.0)) > upper_tail ? low : high) = z;
  }
  return low;
}

// One kind of comparison over all scenes, and one more: the mean of the relative differences, weighted by
// their inverse variances, which sees what is too small for any scene alone.
class Agreement {
 public:
  explicit Agreement(std::string what) : what_(std::move(what)) {}
  void expect(const Estimate& a, const Estimate& b) {
    const double error = std::hypot(a.error, b.error) / b.mean, difference = a.mean / b.mean - 1;
    check(difference, error, what_);
    worst_error_ = std::max(worst_error_, error);
    weighted_ += difference / (error * error);
    weights_ += 1 / (error * error);
    ++scenes_;
  }
  void finish() {
    EXPECT_EQ(scenes_, static_cast<int>(test::kRandomScenes));
    const double error = 1 / std::sqrt(weights_);
    check(weighted_ / weights_, error, what_ + ", all scenes together");
    // What tests of this size can see.
    EXPECT_LT(worst_error_, 0.05) << what_;
    EXPECT_LT(error, 0.005) << what_;
    std::printf(
        "%s: %+.2f +- %.2f %% over all scenes; largest z %.2f of %.2f; worst error in one scene %.1f %%\n",
        what_.c_str(), 100 * weighted_ / weights_, 100 * error, largest_, kLimit, 100 * worst_error_);
  }

 private:
  void check(double difference, double error, const std::string& what) {
    EXPECT_LE(std::abs(difference), kLimit * error) << what;
    largest_ = std::max(largest_, std::abs(difference) / error);
  }
  // Three kinds of pairs of strategies, for emissive surfaces and for area lights, and one of choices of
  // lights.
  inline static const double kLimit = normal_quantile(kSignificance / (2.0 * 7 * (test::kRandomScenes + 1)));
  std::string what_;
  int scenes_ = 0;
  double largest_ = 0, worst_error_ = 0, weighted_ = 0, weights_ = 0;
};

TransportSettings settings(MisMode mis_mode, uint64_t seed) {
  TransportSettings s;
  s.mis_mode = mis_mode;
  s.seed = seed;
  s.max_bounces = 8;
  return s;
}

// Scenes by their seed.
void expect_strategies_agree(const std::function<Scene(uint32_t)>& make) {
  // Each estimate has random numbers of its own; the pairs of one scene share estimates, which Bonferroni's
  // bound allows.
  Agreement lights_both("light sampling alone against both"), paths_both("paths alone against both"),
      lights_paths("light sampling alone against paths alone");
  for (uint32_t seed = 0; seed < test::kRandomScenes; ++seed) {
    SCOPED_TRACE(seed);
    const test::ReadyScene scene(make(seed));
    const Estimate lights = scene.mean_e(settings(MisMode::kLights, 1), kSamples, kStep);
    const Estimate paths = scene.mean_e(settings(MisMode::kPaths, 2), 4 * kSamples, kStep);
    const Estimate both = scene.mean_e(settings(MisMode::kBoth, 3), kSamples, kStep);
    lights_both.expect(lights, both);
    paths_both.expect(paths, both);
    lights_paths.expect(lights, paths);
  }
  for (Agreement* a : {&lights_both, &paths_both, &lights_paths}) a->finish();
}

TEST(MisMode, LightsAlonePathsAloneAndBothAgree) {
  expect_strategies_agree([](uint32_t seed) { return test::random_scene(seed, false); });
}

// Beside emissive surfaces in every other scene, and behind glass and veils wherever there are some.
TEST(MisMode, AreaLightsByLightsAloneByPathsAloneAndByBothAgree) {
  expect_strategies_agree([](uint32_t seed) {
    return test::with_area_lights(test::random_scene(seed, false), seed, seed % 2 == 0);
  });
}

TEST(MisMode, LightTreeAndUniformChoiceAgree) {
  Agreement agreement("uniform choice against the tree");
  for (uint32_t seed = 0; seed < test::kRandomScenes; ++seed) {
    SCOPED_TRACE(seed);
    const test::ReadyScene tree(test::random_scene(seed, true));
    const test::ReadyScene uniform(test::random_scene(seed, true), LightChoice::kUniform);
    agreement.expect(uniform.mean_e(settings(MisMode::kBoth, 4), kSamples, kStep),
                     tree.mean_e(settings(MisMode::kBoth, 5), kSamples, kStep));
  }
  agreement.finish();
}

}  // namespace
}  // namespace kiln

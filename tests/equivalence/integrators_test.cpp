// Integrators compiled for less than everything, and batches of any size, give the same bits.
#include <cstring>
#include <numeric>

#include "tests/equivalence/random_scenes.h"
#include "tests/equivalence/ready_scene.h"

namespace kiln {
namespace {

constexpr uint32_t kSamples = 96;

using Taken = std::vector<RadianceSamples>;

// Samples in the order of the list, `batch` at a time, given by their number.
Taken take(const test::ReadyScene& scene, const Integrator& integrator, uint32_t site,
           const std::vector<uint32_t>& order, size_t batch) {
  const auto workspace = integrator.make_workspace();
  Taken taken(order.size());
  std::vector<Integrator::Task> tasks;
  for (size_t first = 0; first < order.size(); first += batch) {
    tasks.clear();
    const size_t end = std::min(order.size(), first + batch);
    for (size_t i = first; i < end; ++i) tasks.push_back(scene.task({}, site, order[i]));
    integrator.sample(tasks, *workspace);
    for (size_t i = first; i < end; ++i) taken[order[i]] = tasks[i - first].radiance;
  }
  return taken;
}

bool same_bits(const RadianceSamples& a, const RadianceSamples& b) {
  return a.count == b.count && a.inside == b.inside && a.rays == b.rays &&
         std::memcmp(a.items, b.items, a.count * sizeof(RadianceSamples::RadianceSample)) == 0;
}

void expect_equal(const Taken& a, const Taken& b, const std::string& what) {
  size_t different = 0;
  for (size_t i = 0; i < a.size(); ++i) different += !same_bits(a[i], b[i]);
  EXPECT_EQ(different, 0u) << what << ": of " << a.size() << " samples";
}

// Returns the share of samples that found light: a comparison of nothing proves nothing.
double expect_integrators_agree(const test::ReadyScene& scene) {
  const auto special = scene.integrator({}, scene.features());
  const auto general = scene.integrator({}, kAllFeatures);
  std::vector<uint32_t> forward(kSamples);
  std::iota(forward.begin(), forward.end(), 0);
  const std::vector<uint32_t> backward(forward.rbegin(), forward.rend());
  double found = 0, samples = 0;
  for (const size_t share : {1, 3, 5, 7}) {
    const auto site = static_cast<uint32_t>(scene.texels() * share / 8);
    const Taken taken = take(scene, *special, site, forward, Integrator::kBatch);
    expect_equal(taken, take(scene, *general, site, forward, Integrator::kBatch), "special and general");
    expect_equal(taken, take(scene, *special, site, forward, 1), "batches of 32 and 1");
    expect_equal(taken, take(scene, *special, site, backward, 7), "other company");
    expect_equal(taken, take(scene, *general, site, backward, 7), "general, other company");
    for (const RadianceSamples& s : taken) found += s.count > 0, ++samples;
  }
  return found / samples;
}

TEST(Integrators, SpecialAndGeneralGiveTheSameBitsInRandomScenes) {
  for (uint32_t seed = 0; seed < test::kRandomScenes; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_GT(expect_integrators_agree(test::ReadyScene(test::random_scene(seed, true))), 0.2);
    const test::ReadyScene area(test::with_area_lights(test::random_scene(seed, true), seed, false));
    EXPECT_TRUE(area.features() & kAreaLights);
    EXPECT_GT(expect_integrators_agree(area), 0.2);
  }
}

TEST(Integrators, SpecialAndGeneralGiveTheSameBitsForEverySetOfFeatures) {
  for (uint32_t features = 0; features <= kAllFeatures; ++features) {
    const bool of_a_scene =
        !(features & kOneStrategy) && (!(features & kAreaLights) || features & kLocalLights);
    if (!of_a_scene) continue;
    SCOPED_TRACE(features);
    const test::ReadyScene scene(test::scene_of(features));
    // What lets light through has layers as well.
    EXPECT_EQ(scene.features(), features & kGlass ? features | kLayers : features);
    EXPECT_GT(expect_integrators_agree(scene), 0.5);
  }
}

}  // namespace
}  // namespace kiln

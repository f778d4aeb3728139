// --two-pass as a user runs it: a plaza under an even sky, a crate on it, and a vault that no light reaches.
#include "coordinator/run/two_pass.h"

#include "common/base/files.h"
#include "coordinator/bake/collapse/same_charts.h"
#include "coordinator/measure/compare/error_map.h"
#include "tests/bake/scene_gltf.h"
#include "tests/import/gltf_builder.h"
#include "tests/unseen/world.h"

namespace kiln {
namespace {
using nlohmann::json;

class TwoPass : public testing::Test {
 protected:
  test::CommandResult kiln(const std::string& arguments) { return test::run_kiln(dir_.path(), arguments); }
  std::string read(const std::string& file) {
    const auto bytes = read_file(dir_.path() / file);
    EXPECT_TRUE(bytes) << file;
    return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "null";
  }
  json report(const std::string& folder) { return json::parse(read(folder + "/report.json")); }

  // The plaza is two plates: nothing stands on the first.
  TwoPass() {
    test::World world;
    world.add(test::plane(1, 10, test::Uv::kNone), "plaza", Vec3(0.0f));
    world.add(test::plane(1, 10, test::Uv::kNone), "yard", Vec3(10, 0, 0));
    world.solid({Vec3(14, 0, 4), Vec3(16, 2, 6)}, "crate");
    world.room({Vec3(40, 0, 0), Vec3(44, 3, 4)}, "vault");
    test::write_scene_glb(world.scene, dir_.path() / "x.glb");
  }
  static std::string bake(const std::string& folder, const std::string& more) {
    return "bake x.glb -o " + folder +
           " --layout pack --environment 1,1,1 --preview off --encode none --unwrap-cache "
           "off --quiet " +
           more;
  }
  test::TempDir dir_;
};

const std::string kFixed = " --min-samples 64 --max-samples 64 --denoise off ";

// By chart: the light of its texels.
struct Light {
  double low = 1e300, high = -1e300, stated = 0;
  std::vector<double> texels;
};
std::vector<Light> light_by_chart(const std::filesystem::path& folder, size_t charts) {
  const auto map = *read_error_map(folder);
  std::vector<Light> out(charts);
  for (size_t t = 0; t < map.light.size(); ++t) {
    if (map.chart[t] == 0) continue;
    Light& chart = out[map.chart[t] - 1];
    chart.texels.push_back(map.light[t]);
    chart.low = std::min(chart.low, map.light[t]);
    chart.high = std::max(chart.high, map.light[t]);
    chart.stated = std::max(chart.stated, map.stated[t]);
  }
  return out;
}

TEST(StateDeviations, AddsWhatOneValueIsWrongByToTheNoise) {
  Atlas atlas;
  atlas.owner = {1, 2, 0, 2};
  atlas.sites.texel = {0, 1, 3};
  atlas.collapsed = {kUnlit, kEvenlyLit};
  const std::vector<ChartLight> light = {{kUnlit, {}}, {kEvenlyLit, {0.3f, 0.4f, 1.2f}}};
  TexelErrors errors{{0, 1, 1}, {0.1f, 0.4f, 0.0f}};
  state_deviations(atlas, light, errors);
  const float expected[] = {0.1f, 0.5f, 0.3f};
  for (size_t i = 0; i < 3; ++i) EXPECT_FLOAT_EQ(errors.standard_error[i], expected[i]);
  Lightmap map;
  map.band_error.width = map.band_error.height = 2;
  map.band_error.add("L0") = {0.1f, 0.3f, 0, 0};
  map.band_error.add("L1") = {0.1f, 0.5f, 0, 0};
  state_deviations(atlas, light, basis_roster()[*find_basis("sh_l1")], map);
  EXPECT_FLOAT_EQ(map.band_error.plane("L0")[0], 0.1f);
  EXPECT_FLOAT_EQ(map.band_error.plane("L0")[1], 0.5f);
  EXPECT_FLOAT_EQ(map.band_error.plane("L0")[3], 0.4f);
  EXPECT_FLOAT_EQ(map.band_error.plane("L1")[1], 1.3f);
}

// The second plate joins the first, with a crate's shadow: seams and the denoiser must not carry it over.
class TwoPassLight : public TwoPass, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Denoise, TwoPassLight, testing::Values("off", "on"));

TEST_P(TwoPassLight, EvenAndBlackChartsAreSmallAndHoldTheirLight) {
  // The crate's light on the plaza and the noise of 32 samples come close to what 5 % allows of L1.
  const std::string fixed =
      std::string(" --error 0.08 --min-samples 128 --max-samples 128 --denoise ") + GetParam() + " ";
  const auto with = kiln(bake("with", fixed + "--two-pass on")), without = kiln(bake("without", fixed));
  ASSERT_EQ(with.exit_status, 0) << with.output;
  ASSERT_EQ(without.exit_status, 0) << without.output;
  EXPECT_SAYS(with.output, "lit the same all over");
  EXPECT_SAYS(with.output, "(--two-pass on)");
  const json a = report("with")["atlas"], b = report("without")["atlas"];
  const json& two = a["two_pass"];
  EXPECT_FALSE(b.contains("two_pass"));
  EXPECT_EQ(two["samples"], 32);
  EXPECT_GE(two["charts_constant"], 1);
  EXPECT_GE(two["charts_black"], 6) << "the inner sides of the vault";
  EXPECT_EQ(two["black_that_met_light"], 0);
  EXPECT_EQ(a["charts"], b["charts"]);
  EXPECT_LT(a["valid_texels"], b["valid_texels"]);
  EXPECT_GT(two["saved_texels"], 1000);

  const auto rows = [&](const std::string& folder, const char* name) {
    const json all = report(folder);
    for (const json& o : all["objects"])
      if (o["name"].get<std::string>().find(name) != std::string::npos) return o;
    return json{};
  };
  EXPECT_LE(rows("with", "plaza")["texels"], 4);
  EXPECT_EQ(rows("with", "yard")["texels"], rows("without", "yard")["texels"]) << "the crate's shadow";

  // What is shown of a chart that collapsed is what all of its texels showed, within both stated errors.
  const size_t charts = a["charts"];
  std::vector<uint8_t> collapsed(charts, 0);
  ASSERT_TRUE(read_charts(two["collapsed"]["constant"].get<std::string>(), kEvenlyLit, collapsed));
  ASSERT_TRUE(read_charts(two["collapsed"]["black"].get<std::string>(), kUnlit, collapsed));
  const std::vector<Light> small = light_by_chart(dir_.path() / "with", charts),
                           whole = light_by_chart(dir_.path() / "without", charts);
  size_t compared[kCollapseReasons] = {};
  for (size_t c = 0; c < charts; ++c) {
    // Of the narrowest charts no texel's centre is within their box.
    if (!collapsed[c] || whole[c].texels.empty() || small[c].texels.empty()) continue;
    ++compared[collapsed[c]];
    EXPECT_LE(small[c].texels.size(), 4u) << c;
    if (collapsed[c] == kUnlit) {
      EXPECT_EQ(small[c].high, 0) << c;
      EXPECT_EQ(whole[c].high, 0) << c;
      continue;
    }
    EXPECT_GT(small[c].stated, 0) << c;
    EXPECT_LE(3 * small[c].stated, 0.1 * small[c].low) << "an error that says nothing would cover anything";
    for (const double e : small[c].texels)
      for (const double each : whole[c].texels)
        ASSERT_NEAR(e, each, 4.5 * std::hypot(small[c].stated, whole[c].stated)) << c;
  }
  EXPECT_GE(compared[kEvenlyLit], 1u);
  EXPECT_GE(compared[kUnlit], 6u);
}

TEST_F(TwoPass, TexturesCanBeMadeAgain) {
  // The layout was decided by light, which `kiln encode` does not have: the report says how.
  ASSERT_EQ(kiln(bake("out", kFixed + "--two-pass on --texels-per-metre 32 --max-texels 8000")).exit_status,
            0);
  const auto again = kiln("encode x.glb --from out -o again --encode bc6h");
  EXPECT_EQ(again.exit_status, 0) << again.output;
}

TEST_F(TwoPass, WithABudgetOthersGetWhatIsSaved) {
  const std::string budget = kFixed + "--texels-per-metre 32 --max-texels 8000 ";
  ASSERT_EQ(kiln(bake("with", budget + "--two-pass on")).exit_status, 0);
  ASSERT_EQ(kiln(bake("without", budget)).exit_status, 0);
  const json a = report("with")["atlas"], b = report("without")["atlas"];
  EXPECT_LE(a["texels"], 8000);
  EXPECT_GT(a["texels_per_metre"].get<double>(), 1.1 * b["texels_per_metre"].get<double>());
}

TEST_F(TwoPass, SaysWhereItIsNotHeeded) {
  EXPECT_SAYS(kiln("plan x.glb --layout pack --two-pass on").output,
              "only a bake's first pass can find charts");
  EXPECT_SAYS(kiln("plan x.glb --two-pass perhaps").output, "'perhaps' is not one of");
  test::World world;
  world.add(test::plane(1, 4, test::Uv::kUnit), "floor", Vec3(0.0f));
  test::write_scene_glb(world.scene, dir_.path() / "own.glb");
  EXPECT_SAYS(kiln("plan own.glb --layout atlas --two-pass on").output,
              "--two-pass on has no effect on the file's own atlas");
}

TEST_F(TwoPass, WithoutTimeForTwoPassesThereIsOne) {
  const auto done = kiln(bake("out", "--two-pass on --time-limit 3"));
  EXPECT_SAYS(done.output, "the first pass of --two-pass was left out");
  EXPECT_EQ(report("out")["atlas"]["two_pass"]["samples"], 0);
  const auto enough = kiln(bake("out", "--two-pass on --time-limit 30 --error 0.3"));
  EXPECT_EQ(enough.exit_status, 0) << enough.output;
  const json all = report("out");
  EXPECT_EQ(all["atlas"]["two_pass"]["samples"], 32);
  EXPECT_LE(all["total_seconds"], 30);
}

TEST_F(TwoPass, TheBytesAreTheSameForAnyNumberOfWorkersAndThreads) {
  std::string first;
  for (const char* force :
       {"--workers 1 --threads 1", "--workers 2 --threads 1", "--workers 1 --threads 3 --tile-texels 64"}) {
    const auto done = kiln(bake("out", kFixed + "--two-pass on " + force));
    ASSERT_EQ(done.exit_status, 0) << done.output;
    const std::string bytes = read("out/irradiance.exr") + read("out/error.exr") + read("out/charts.json");
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first) << force;
  }
}

}  // namespace
}  // namespace kiln

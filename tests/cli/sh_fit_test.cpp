// --sh-fit and --sh-evaluator end to end: what masters hold, and what textures and the report say of it.
#include <fstream>

#include "common/base/files.h"
#include "common/base/json.h"
#include "common/responses/basis.h"
#include "common/responses/evaluate.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

class ShFit : public testing::Test {
 protected:
  ShFit() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  test::CommandResult kiln(const std::string& arguments) const {
    return test::run_kiln(dir_.path(), arguments);
  }
  void bake(const std::string& options) const {
    const auto result = kiln(
        "bake room.glb -o out --quiet --preview off --texels-per-metre 4 --min-samples 16 "
        "--max-samples 16 " +
        options);
    ASSERT_EQ(result.exit_status, 0) << result.output;
  }
  std::string text_of(const char* file) const {
    std::ifstream in(dir_.path() / "out" / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // The first texture's error at the surface's own normal, against E.
  double off_e(const char* what) const {
    const auto report = parse_json(text_of("report.json"));
    return report->find("textures")->items[0].find("at_normals")->items[0].find(what)->number;
  }

  // Share of measured texels whose basis shows E to `tolerance` at one of the six normals that the room has.
  template <class Evaluate>
  double share_that_shows_e(double tolerance, const Evaluate& evaluate) const {
    const Planes e = *read_exr(dir_.path() / "out/irradiance.exr"),
                 sh = *read_exr(dir_.path() / "out/sh_l1.exr"),
                 classes = *read_exr(dir_.path() / "out/validity.exr");
    double right = 0, count = 0;
    for (size_t t = 0; t < classes.data[0].size(); ++t) {
      const float truth = e.plane("G")[t];
      if (classes.data[0][t] != 1 || !(truth > 0)) continue;
      const Vec3 l1(sh.plane("L1x.G")[t], sh.plane("L1y.G")[t], sh.plane("L1z.G")[t]);
      bool any = false;
      for (int axis = 0; axis < 6; ++axis) {
        Vec3 n(0.0f);
        n[axis / 2] = axis % 2 ? 1.0f : -1.0f;
        any |= std::abs(evaluate(sh.plane("L0.G")[t], l1, n) / truth - 1) < tolerance;
      }
      right += any;
      ++count;
      EXPECT_LE(length(l1), sh.plane("L0.G")[t] * (1 + 1e-6f));
    }
    EXPECT_GT(count, 100);
    return right / count;
  }

  test::TempDir dir_;
};

// Halves are within 2^-12 of their values, evenly: three terms of E of a size up to twice E.
constexpr double kHalves = 6 * 0x1p-12;

TEST_F(ShFit, ShowsEAtTheSurfacesNormalByDefault) {
  bake("--encode half");
  EXPECT_EQ(share_that_shows_e(1e-5, sh_l1_irradiance), 1);
  EXPECT_LT(std::abs(off_e("bias")), kHalves);
  EXPECT_LT(off_e("rms"), kHalves);
  const std::string glb = text_of("scene.glb");
  EXPECT_NE(glb.find("\"fit\":\"cap\""), std::string::npos);
  EXPECT_NE(glb.find("\"evaluator\":\"linear\""), std::string::npos);
}

TEST_F(ShFit, MayBeMadeForHazelsEvaluation) {
  bake("--encode half --sh-evaluator hazel");
  EXPECT_EQ(share_that_shows_e(1e-4, sh_l1_irradiance_nonlinear), 1);
  EXPECT_LT(off_e("rms"), 2 * kHalves);  // the form's slope adds to it
  EXPECT_NE(text_of("scene.glb").find("\"evaluator\":\"hazel\""), std::string::npos);
}

// The projection is the light's, whatever the normal: off E by what the two bases differ by.
TEST_F(ShFit, ProjectionShowsSomethingElse) {
  bake("--encode half --sh-fit project");
  EXPECT_LT(share_that_shows_e(1e-3, sh_l1_irradiance), 0.5);
  EXPECT_GT(off_e("rms"), 0.02);
  EXPECT_NE(text_of("scene.glb").find("\"fit\":\"project\""), std::string::npos);
}

TEST_F(ShFit, EncodeReadsMastersAsTheyWereBaked) {
  bake("--encode none");
  for (const char* option : {"--sh-fit project", "--sh-evaluator hazel"}) {
    const auto refused = kiln(std::string("encode room.glb --from out -o again ") + option);
    EXPECT_EQ(refused.exit_status, 2);
    EXPECT_NE(refused.output.find("were baked with"), std::string::npos) << refused.output;
    EXPECT_NE(refused.output.find("bake again"), std::string::npos);
  }
  EXPECT_EQ(kiln("encode room.glb --from out -o again --sh-fit cap --encode half").exit_status, 0);
  // Reports of releases that knew no fits hold projections.
  std::string report = text_of("report.json");
  const size_t at = report.find("\"sh-fit\"");
  ASSERT_NE(at, std::string::npos);
  report.replace(at, 8, "\"was-not\"");
  std::ofstream(dir_.path() / "out/report.json", std::ios::binary) << report;
  const Planes sh = *read_exr(dir_.path() / "out/sh_l1.exr");
  std::vector<ExrChannel> channels;
  for (size_t p = 0; p < sh.names.size(); ++p) channels.push_back({sh.names[p], sh.data[p].data()});
  ASSERT_TRUE(write_exr(dir_.path() / "out/sh_l1.exr", sh.width, sh.height, channels, {ExrType::kFloat}, {}));
  const auto old = kiln("encode room.glb --from out -o old --encode half");
  EXPECT_EQ(old.exit_status, 0) << old.output;
  std::ifstream in(dir_.path() / "old/scene.glb", std::ios::binary);
  const std::string glb{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(glb.find("\"fit\":\"project\""), std::string::npos);
}

}  // namespace
}  // namespace kiln

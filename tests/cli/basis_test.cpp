// --basis end to end, for every basis and fit: masters that show E, textures that are made of them, and what
// cannot be stored.
#include "common/responses/basis.h"

#include <fstream>

#include "common/base/files.h"
#include "common/base/json.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

class BasisCli : public testing::Test {
 protected:
  BasisCli() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  test::CommandResult kiln(const std::string& arguments) const {
    return test::run_kiln(dir_.path(), arguments);
  }
  test::CommandResult bake(const std::string& options) const {
    return kiln(
        "bake room.glb -o out --quiet --preview off --texels-per-metre 4 --min-samples 16 --max-samples 16 " +
        options);
  }
  std::string text_of(const char* file) const {
    std::ifstream in(dir_.path() / "out" / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  double format_error() const {
    const auto report = parse_json(text_of("report.json"));
    return report->find("textures")->items[0].find("at_normals")->items[0].find("rms")->number;
  }
  // Share of measured texels where E follows from the basis at one of the six normals that the room has.
  double share_that_shows_e(const BasisInfo& basis) const {
    const Planes e = *read_exr(dir_.path() / "out/irradiance.exr"),
                 stored = *read_exr(dir_.path() / ("out/" + std::string(basis.name) + ".exr")),
                 classes = *read_exr(dir_.path() / "out/validity.exr");
    double right = 0, count = 0;
    for (size_t t = 0; t < classes.data[0].size(); ++t) {
      const float truth = e.plane("G")[t];
      if (classes.data[0][t] != 1 || !(truth > 0)) continue;
      float f[kMaxBasisFunctions] = {};
      for (size_t k = 0; k < basis.functions.size(); ++k) {
        f[k] = stored.plane(std::string(basis.functions[k]) + ".G")[t];
        if (!basis.is_signed[k]) EXPECT_GE(f[k], 0.0f);
      }
      bool any = false;
      for (int axis = 0; axis < 6; ++axis) {
        Vec3 n(0.0f);
        n[axis / 2] = axis % 2 ? 1.0f : -1.0f;
        any |= std::abs(basis.irradiance(f, n, n) / truth - 1) < 1e-4f;
      }
      right += any;
      ++count;
    }
    EXPECT_GT(count, 100);
    return right / count;
  }

  test::TempDir dir_;
};

TEST_F(BasisCli, EveryFitShowsEAtTheSurfacesNormal) {
  for (const char* name : {"sh_l2", "h6", "ad9", "ad12", "sg9", "sg12"})
    for (const char* fit : {"cap", "positive", "project"}) {
      const auto index = find_basis(name, fit);
      if (!index) continue;
      const BasisInfo& basis = basis_roster()[*index];
      const auto result = bake(std::string("--encode half --basis ") + name + " --sh-fit " + fit);
      ASSERT_EQ(result.exit_status, 0) << result.output;
      const double share = share_that_shows_e(basis);
      if (basis.fit == "project") {
        EXPECT_LT(share, 0.5) << name;
      } else {
        EXPECT_EQ(share, 1) << name << " " << fit;
        // Halves are within 2^-12 of their values, and lobes of both signs are several times what they show.
        EXPECT_LT(format_error(), 32 * 0x1p-12) << name << " " << fit;
      }
      const std::string glb = text_of("scene.glb");
      EXPECT_NE(glb.find("\"fit\":\"" + std::string(basis.fit) + "\""), std::string::npos) << name;
      EXPECT_EQ(glb.find("\"frame\":") != std::string::npos, basis.is_local) << name;
      EXPECT_EQ(glb.find("\"lobes\":") != std::string::npos, !basis.axes.empty()) << name;
    }
}

// Each default texture format, and blocks of both kinds; a folder is encoded again as it was baked.
TEST_F(BasisCli, TexturesOfEveryBasis) {
  for (const char* name : {"sh_l2", "h6", "ad9", "sg12"}) {
    ASSERT_EQ(bake(std::string("--encode bc6h --max-encode-error 0 --basis ") + name).exit_status, 0);
    EXPECT_LT(format_error(), 0.3) << name;  // of a small map with noise
    EXPECT_EQ(kiln("encode room.glb --from out -o again --encode half").exit_status, 0) << name;
  }
  for (const char* encoding : {"rgb9e5", "astc-4x4 --container ktx2", "rgbm"}) {
    const auto result = bake(std::string("--basis sg9 --sh-fit positive --encode ") + encoding);
    EXPECT_EQ(result.exit_status, 0) << result.output;
  }
}

// A preset has a density and pages of its own, and a finished bake has had them.
TEST_F(BasisCli, PresetsEncodeABakeOfAnotherDensity) {
  ASSERT_EQ(bake("--encode none").exit_status, 0);
  ASSERT_TRUE(
      write_file_atomic(dir_.path() / "preset.json",
                        R"({"encode": "half", "container": "dds", "texels-per-metre": 3, "page-size": 64,
                                    "mip-levels": 3, "basis": "sg9"})"));
  const auto result = kiln("encode room.glb --from out -o again --config preset.json");
  EXPECT_EQ(result.exit_status, 0) << result.output;
  EXPECT_TRUE(std::filesystem::exists(dir_.path() / "again/lightmap_half_L0.dds"));
  const auto refused = kiln("encode room.glb --from out -o other --encode half --texels-per-metre 3");
  EXPECT_EQ(refused.exit_status, 2) << "said on the command line: " << refused.output;
}

TEST_F(BasisCli, WhatCannotBeStoredIsRefused) {
  const std::pair<const char*, const char*> cases[] = {
      {"--basis ad9 --encode astc-4x4 --container ktx2", "--sh-fit positive"},
      {"--basis sg12 --sh-fit project --encode rgbm", "--encode bc6h"},
      {"--basis ad9 --sh-evaluator hazel", "--sh-evaluator"},
      {"--basis sh_l2 --sh-fit positive", "docs/bases.md"},
      {"--basis sh_l1 --sh-fit positive", "docs/bases.md"},
      {"--basis ad10", "sh_l1, sh_l2, h6, ad9, ad12, sg9, sg12"},
  };
  for (const auto& [options, way_out] : cases) {
    const auto result = bake(options);
    EXPECT_EQ(result.exit_status, 2) << options;
    EXPECT_NE(result.output.find(way_out), std::string::npos) << options << ": " << result.output;
    EXPECT_FALSE(std::filesystem::exists(dir_.path() / "out"));
  }
  ASSERT_EQ(bake("--basis ad9 --encode none").exit_status, 0);
  for (const char* options : {"--basis sg9", "--sh-fit positive", "--encode astc-4x4 --container ktx2"}) {
    const auto result = kiln(std::string("encode room.glb --from out -o again ") + options);
    EXPECT_EQ(result.exit_status, 2) << options << result.output;
  }
}

}  // namespace
}  // namespace kiln

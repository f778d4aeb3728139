// Textures made again from masters are the textures of the bake.
#include <cmath>
#include <fstream>
#include <limits>
#include <map>

#include "common/base/files.h"
#include "coordinator/run/encode_run.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

class Encode : public testing::Test {
 protected:
  Encode() {
    test::write_scene_glb(test::small_room(), scene());
    BakeRequest r;
    r.scene = scene();
    r.output = out();
    r.worker_program = test::binary_dir() / "bin/kiln-worker";
    r.settings.unwrap_cache = "off";
    for (const auto& [name, value] : std::map<std::string, std::string>{{"layout", "pack"},
                                                                        {"texels-per-metre", "3"},
                                                                        {"min-samples", "4"},
                                                                        {"max-samples", "4"},
                                                                        {"workers", "1"},
                                                                        {"mip-levels", "1"},
                                                                        {"encode", "bc6h,rgbm"},
                                                                        {"encode-quantity", "both"}})
      EXPECT_TRUE(set_option(r.settings, name, value, "test"));
    const auto report = run_bake(r, [](const BakeProgress&) {});
    EXPECT_TRUE(report) << (report ? "" : report.error().message);
    if (report) baked_ = *report;
  }
  std::filesystem::path scene() const { return dir_.path() / "room.glb"; }
  std::filesystem::path out() const { return dir_.path() / "out"; }
  Expected<EncodeReport> encode(const std::string& folder,
                                const std::map<std::string, std::string>& options = {}) {
    EncodeRequest r{scene(), out(), dir_.path() / folder, {}};
    for (const auto& [name, value] : options)
      EXPECT_TRUE(set_option(r.settings, name, value, "command line"));
    return run_encode(r, [](const BakeProgress&) {});
  }
  std::string refusal(const Expected<EncodeReport>& r) {
    EXPECT_FALSE(r);
    return r ? "" : r.error().message;
  }

  test::TempDir dir_;
  BakeReport baked_;
};

TEST_F(Encode, GivesTheBytesOfTheBake) {
  const auto again = encode("again");
  ASSERT_TRUE(again) << again.error().message;
  std::map<std::string, Digest> digests;
  for (const OutputFile& f : again->files) digests[f.name] = f.digest;
  size_t textures = 0;
  for (const OutputFile& f : baked_.outputs) {
    ASSERT_TRUE(digests.count(f.name)) << f.name;
    EXPECT_EQ(digests[f.name].hex(), f.digest.hex()) << f.name;
    textures += f.name.rfind("lightmap_", 0) == 0;
  }
  EXPECT_EQ(textures, 2 * 5 + 5u);  // DDS and KTX2 of L0, L1x, L1y, L1z, E; as many PNG
  ASSERT_EQ(again->textures.size(), baked_.textures.size());
  for (size_t k = 0; k < baked_.textures.size(); ++k)
    EXPECT_EQ(again->textures[k].error.rel_mse, baked_.textures[k].error.rel_mse);
}

TEST_F(Encode, TakesOtherSettings) {
  const auto other =
      encode("other", {{"encode", "half"}, {"container", "ktx2"}, {"encode-quantity", "basis"}});
  ASSERT_TRUE(other) << other.error().message;
  ASSERT_EQ(other->textures.size(), 1u);
  EXPECT_EQ(other->textures[0].encoding, "half");
  EXPECT_TRUE(std::filesystem::exists(dir_.path() / "other/lightmap_half_L0.ktx2"));
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "other/lightmap_half_L0.dds"));
  EXPECT_TRUE(std::filesystem::exists(dir_.path() / "other/scene.glb"));
  const auto tight = encode("tight", {{"max-encode-error", "1e-9"}});
  ASSERT_TRUE(tight);
  EXPECT_NE(tight->unmet.find("bc6h"), std::string::npos) << tight->unmet;
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "tight/lightmap_bc6h_L0.ktx2"));
}

TEST_F(Encode, RefusesWhatDoesNotBelongTogether) {
  EXPECT_NE(refusal(encode("x", {{"texels-per-metre", "4"}})).find("another scene or layout"),
            std::string::npos);
  std::ofstream(out() / "charts.json", std::ios::app) << " ";
  EXPECT_NE(refusal(encode("x")).find("charts.json"), std::string::npos);
  std::filesystem::remove(out() / "sh_l1.exr");
  EXPECT_NE(refusal(encode("x")).find("sh_l1.exr"), std::string::npos);
  std::ofstream(out() / "report.json") << "{";
  EXPECT_NE(refusal(encode("x")).find("report.json"), std::string::npos);
  std::filesystem::remove(out() / "report.json");
  EXPECT_NE(refusal(encode("x")).find("not an output folder of a bake"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "x"));
}

// Writes one channel's first texel anew, and the header's notes.
void change_master(const std::filesystem::path& path, const std::string& channel, float value,
                   const ExrNotes& notes) {
  Planes planes = *read_exr(path);
  planes.plane(channel)[planes.width + 2] = value;
  std::vector<ExrChannel> channels;
  for (size_t k = 0; k < planes.names.size(); ++k)
    channels.push_back({planes.names[k], planes.data[k].data()});
  ASSERT_TRUE(write_exr(path, planes.width, planes.height, channels, {}, notes));
}

TEST_F(Encode, RefusesMastersThatAreNoNumbers) {
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()})
    for (const auto& [file, channel] : {std::pair("irradiance", "G"), {"sh_l1", "L1y.B"}, {"error", "Y"}}) {
      const std::filesystem::path path = out() / (std::string(file) + ".exr");
      const Bytes before = *read_file(path);
      change_master(path, channel, bad, *read_exr_notes(path));
      const auto result = encode("x");
      const std::string why = refusal(result);
      for (const std::string& part : {path.filename().string(), std::string("channel ") + channel,
                                      std::string("texel (2, 1)"), std::string("Bake again")})
        EXPECT_NE(why.find(part), std::string::npos) << why;
      if (!result) EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);  // exit status 2
      ASSERT_TRUE(write_file_atomic(path, before));
    }
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "x"));
}

TEST_F(Encode, RefusesAnotherFitOrBasis) {
  const std::filesystem::path path = out() / "sh_l1.exr";
  ExrNotes notes = *read_exr_notes(path);
  EXPECT_EQ(notes["basis"], "sh_l1");
  const std::string fit = notes["fit"];
  EXPECT_EQ(fit, "cap");
  const float same = read_exr(path)->plane("L0.R")[read_exr(path)->width + 2];
  notes["fit"] = "other";
  change_master(path, "L0.R", same, notes);
  const std::string why = refusal(encode("x"));
  for (const char* part : {"sh_l1.exr", "'other'", "'cap'", "bake again"})
    EXPECT_NE(why.find(part), std::string::npos) << why;
  notes["basis"] = "h6";
  change_master(path, "L0.R", same, notes);
  EXPECT_NE(refusal(encode("x")).find("basis h6"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "x"));
  notes["basis"] = "sh_l1";
  notes["fit"] = fit;
  change_master(path, "L0.R", same, notes);
  EXPECT_TRUE(encode("x"));
}

// Every EXR says what it is.
TEST_F(Encode, HeadersSayQuantityUnitBasisFitAndVersion) {
  size_t seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(out())) {
    if (entry.path().extension() != ".exr") continue;
    const auto notes = read_exr_notes(entry.path());
    ASSERT_TRUE(notes) << entry.path();
    for (const char* key : {"quantity", "unit", "basis", "fit", "version"})
      EXPECT_TRUE(notes->contains(key) && !notes->at(key).empty()) << entry.path() << " " << key;
    const bool of_basis = entry.path().filename().string().find("sh_l1") != std::string::npos;
    EXPECT_EQ(notes->at("basis") == "sh_l1", of_basis || entry.path().stem() == "measured") << entry.path();
    ++seen;
  }
  EXPECT_GE(seen, 6u);
}

}  // namespace
}  // namespace kiln

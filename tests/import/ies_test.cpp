// IES profiles: the LM-63 reader, and EXT_lights_ies.
#include <random>
#include <span>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/scene/import/hot_spots.h"
#include "coordinator/scene/import/ies_profile.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;
using N = std::vector<double>;

// A file with three vertical angles; one plane of candela is 100, 50, 10 plus its number.
std::string ies(const std::string& horizontal, int planes, const std::string& head = "IESNA:LM-63-2002",
                const std::string& tilt = "TILT=NONE", const std::string& type = "1") {
  std::string out =
      head + "\r\n[TEST] a lamp\r\n" + tilt + "\r\n" +
      text("1 1000 2 3 {} {} 2 0.1 0.1 0\r\n0.5 4 100\r\n0 45 90\r\n{}\r\n", planes, type, horizontal);
  for (int i = 0; i < planes; ++i) out += text("{}, {}\n {}\n", 100 + i, 50 + i, 10 + i);
  return out;
}
IesProfile read(const std::string& file) {
  const auto p = parse_ies(file);
  EXPECT_TRUE(p.has_value()) << p.error().message;
  return p ? *p : IesProfile{};
}
std::string refusal(const std::string& file) {
  return test::message_of(parse_ies(file));
}

TEST(IesProfile, FactorsByVersion) {
  // Multiplier 2 and ballast factor 0.5; the third factor, 4, counts in old files alone.
  EXPECT_EQ(read(ies("0", 1)).candela, (N{100, 50, 10}));
  EXPECT_EQ(read(ies("0", 1, "IES:LM-63-2019")).candela, (N{100, 50, 10}));
  for (const char* old : {"IESNA:LM-63-1995", "IESNA91", "[MANUFAC] of 1986"})
    EXPECT_EQ(read(ies("0", 1, old)).candela, (N{400, 200, 40})) << old;
  EXPECT_EQ(read(ies("0", 1)).vertical, (N{0, 45, 90}));
  EXPECT_EQ(read(ies("0", 1)).horizontal, (N{0}));
}

TEST(IesProfile, Tilt) {
  EXPECT_FALSE(read(ies("0", 1)).tilted);
  const IesProfile p = read(ies("0", 1, "IESNA91", "TILT=INCLUDE\n1\n2\n0 90\n1 0.9"));
  EXPECT_TRUE(p.tilted);
  EXPECT_EQ(p.vertical, (N{0, 45, 90}));
  EXPECT_TRUE(read(ies("0", 1, "IESNA91", "TILT=lamp.tlt")).tilted);
}

TEST(IesProfile, SymmetriesAreUnfolded) {
  const auto first_of_planes = [](const IesProfile& p) {
    N out;
    for (size_t i = 0; i < p.candela.size(); i += p.vertical.size()) out.push_back(p.candela[i] - 100);
    return out;
  };
  const IesProfile quadrant = read(ies("0 30 90", 3));
  EXPECT_EQ(quadrant.horizontal, (N{0, 30, 90, 150, 180, 210, 270, 330, 360}));
  EXPECT_EQ(first_of_planes(quadrant), (N{0, 1, 2, 1, 0, 1, 2, 1, 0}));
  const IesProfile half = read(ies("0 100 180", 3));
  EXPECT_EQ(half.horizontal, (N{0, 100, 180, 260, 360}));
  EXPECT_EQ(first_of_planes(half), (N{0, 1, 2, 1, 0}));
  const IesProfile side = read(ies("90 150 180 270", 4, "IESNA:LM-63-1995"));
  EXPECT_EQ(side.horizontal, (N{0, 30, 90, 150, 180, 270, 360}));
  EXPECT_EQ(side.candela[0], 4 * 102);
  EXPECT_EQ(side.candela[3], 4 * 101) << "30 mirrors 150";
  EXPECT_EQ(side.candela[15], 4 * 103);
  EXPECT_EQ(side.candela[18], 4 * 102);
  EXPECT_EQ(read(ies("0 120 360", 3)).horizontal, (N{0, 120, 360}));
  const IesProfile open = read(ies("0 120 240", 3));
  EXPECT_EQ(open.horizontal, (N{0, 120, 240, 360}));
  EXPECT_EQ(first_of_planes(open), (N{0, 1, 2, 0}));
}

TEST(IesProfile, Refusals) {
  EXPECT_SAYS(refusal("hello"), "no line TILT=");
  EXPECT_SAYS(refusal(ies("0", 1, "IESNA91", "TILT=NONE", "2")), "type B (2); type C (1) is read");
  EXPECT_SAYS(refusal(ies("0", 1, "IESNA91", "TILT=NONE", "3")), "type A (3)");
  EXPECT_SAYS(refusal(ies("10 50", 2)), "horizontal angles from 10 to 50");
  EXPECT_SAYS(refusal(ies("0 90 80", 3)), "horizontal angle 2 is 80 after 90");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 5000 1 1 1 0 0 0 1 1 1"), "5000 vertical angles");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 2.5 1 1 1 0 0 0 1 1 1"), "2.5 vertical angles");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 -1 2 1 1 1 0 0 0 1 1 1 0 90 0 1 1"), "are not a valid scale");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 2 1 1 1 0 0 0 1 1 1 0 200 0 1 1"), "from 0 to 200");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 1 -1"), "candela value 1 is -1");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 1 nan"), "which is not a number");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1e300 2 1 1 1 0 0 0 1e300 1 1 0 90 0 1 1"), "candela value 0 is inf");
  EXPECT_SAYS(refusal("TILT=NONE\n1 1 1 4096 4096 1 1 0 0 0 1 1 1 0 90"), "it ends where vertical angle 2");
  EXPECT_SAYS(refusal("TILT=INCLUDE\n1 1e9"), "tilt angles");
}

TEST(IesProfile, DamagedFilesNeverCrash) {
  std::mt19937 random(1);
  const std::string good = ies("0 30 90", 3, "IESNA91", "TILT=INCLUDE\n1\n2\n0 90\n1 0.9");
  size_t read = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string file = good;
    for (unsigned e = 0; e < 1 + random() % 3; ++e) {
      const size_t at = random() % file.size();
      if (random() % 4 == 0)
        file.resize(at + 1);
      else
        file[at] = "0123456789-.e \n,TILT="[random() % 21];
    }
    const auto p = parse_ies(file);
    if (!p) continue;
    ++read;
    ASSERT_EQ(p->candela.size(), p->vertical.size() * p->horizontal.size());
    for (const double c : p->candela) ASSERT_TRUE(c >= 0 && std::isfinite(c));
  }
  EXPECT_GT(read, 1000u);
}

GltfBuilder with_profile(const std::string& file, const char* use = R"({"light": 0})",
                         const char* node = "{}") {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  b.root["extensionsUsed"] = b.root["extensionsRequired"] = {"EXT_lights_ies"};
  b.root["extensions"]["EXT_lights_ies"]["lights"] = {
      {{"name", "lamp"},
       {"bufferView", b.view(std::vector<char>(file.begin(), file.end()))},
       {"mimeType", "application/x-ies-lm-63"}}};
  json n = json::parse(node);
  n["extensions"]["EXT_lights_ies"] = json::parse(use);
  b.node(n);
  return b;
}

TEST(IesLights, RecordsShareAProfile) {
  GltfBuilder b = with_profile(ies("0", 1), R"({"light": 0, "multiplier": 3, "color": [1, 0.5, 2]})",
                               R"({"translation": [1, 2, 3], "scale": [2, 2, 2]})");
  b.node(
      {{"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}, {"extras", {{"kiln", {{"bake", "indirect"}}}}}});
  const ImportResult r = imported(b);
  ASSERT_EQ(r.scene.lights.size(), 2u);
  const Record &a = r.scene.lights[0], &second = r.scene.lights[1];
  EXPECT_EQ(a.type, "ies");
  EXPECT_EQ(a.name, "lamp");
  EXPECT_EQ(a.to_world[3], Vec3(1, 2, 3));
  EXPECT_NEAR(length(a.to_world[2]), 1, 1e-6) << "intensity does not scale with the node";
  EXPECT_EQ(a.find("color")->numbers, (N{1, 0.5, 1})) << "clamped to [0, 1]";
  EXPECT_EQ(a.find("intensity")->numbers, (N{3}));
  EXPECT_EQ(a.find("vertical")->numbers, (N{0, 45, 90}));
  EXPECT_EQ(second.find("intensity")->numbers, (N{1}));
  EXPECT_EQ(second.find("bake")->word, "indirect");
  ASSERT_EQ(r.scene.textures.size(), 1u);
  EXPECT_EQ(second.find("candela")->texture.texture, a.find("candela")->texture.texture);
  EXPECT_EQ(r.scene.textures[0].width, 3u);
  EXPECT_EQ(r.scene.textures[0].height, 1u);
  EXPECT_SAYS(test::all_notes(r), "EXT_lights_ies: profiles of type C photometry are read");
}

TEST(IesLights, FileBesideTheScene) {
  test::TempDir dir;
  GltfBuilder b = with_profile("");
  b.root["extensions"]["EXT_lights_ies"]["lights"][0] = {{"uri", "lamp.ies"}};
  const auto path = test::write_gltf_file(b, dir.path());
  const auto gone = import_scene(path, {});
  EXPECT_SAYS(test::message_of(gone), "IES profile 0: ");
  ASSERT_TRUE(write_file_atomic(dir.path() / "lamp.ies", ies("0", 1, "IESNA91", "TILT=x")));
  const auto r = import_scene(path, {});
  ASSERT_TRUE(r.has_value()) << r.error().message;
  EXPECT_EQ(r->scene.lights.size(), 1u);
  EXPECT_SAYS(test::all_notes(*r), "its factors for tilted lamps are not used");
}

TEST(IesLights, BadOnes) {
  EXPECT_SAYS(refused(with_profile("nonsense")), "IES profile 0 'lamp': it has no line TILT=");
  EXPECT_SAYS(refused(with_profile(ies("0", 1), R"({"light": 3})")), "node 1: IES profile 3 does not exist");
  EXPECT_SAYS(refused(with_profile(ies("0", 1), R"({"light": 0, "multiplier": -1})")), "multiplier -1");
  EXPECT_SAYS(refused(with_profile(ies("0", 1), R"({"light": 0, "color": [1]})")), "not three numbers");
  GltfBuilder b = with_profile(ies("0", 1));
  b.root["extensions"]["EXT_lights_ies"]["lights"][0]["mimeType"] = "text/plain";
  EXPECT_SAYS(refused(b), "its mimeType is 'text/plain'");
  b.root["extensions"]["EXT_lights_ies"]["lights"][0].erase("bufferView");
  EXPECT_SAYS(refused(b), "neither uri nor bufferView");
}

// An image of radiance 1 with one bright texel.
Texture sky(uint32_t width, uint32_t height, uint32_t x, uint32_t y, float bright) {
  Texture t;
  t.width = width, t.height = height, t.channels = 3, t.format = TexelFormat::kFloat32;
  std::vector<Vec3> texels(size_t{width} * height, Vec3(1.0f));
  texels[size_t{y} * width + x] = Vec3(bright);
  const auto bytes = std::as_bytes(std::span<const Vec3>(texels));
  t.texels.assign(bytes.begin(), bytes.end());
  return t;
}

TEST(HotSpots, ShareSizeAndDirection) {
  EXPECT_FALSE(find_hot_spot(sky(256, 128, 0, 64, 90)));
  EXPECT_FALSE(find_hot_spot(sky(256, 128, 0, 64, 0)));
  const auto spot = find_hot_spot(sky(256, 128, 192, 32, 1e5f));  // 0.25 turns from +x: +z; 45 degrees up
  ASSERT_TRUE(spot.has_value());
  const double omega = 2 * M_PI / 256 * (std::cos(M_PI * 32 / 128) - std::cos(M_PI * 33 / 128));
  EXPECT_NEAR(spot->solid_angle, omega, 1e-9);
  EXPECT_NEAR(spot->share, 1e5 * omega / (1e5 * omega + 4 * M_PI - omega), 1e-9);
  const double theta = M_PI * 32.5 / 128, phi = 2 * M_PI * (192.5 / 256 - 0.5);
  EXPECT_NEAR(length(spot->direction -
                     Vec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi))),
              0, 1e-6);
  EXPECT_TRUE(find_hot_spot(sky(256, 128, 3, 4, 1e38f))) << "sums do not overflow";
}

TEST(HotSpots, AreNamedByTheImport) {
  test::TempDir dir;
  // 64 x 32: the texel at (48, 16) is 2^20 times brighter.
  std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n";
  for (int i = 0; i < 64 * 32; ++i)
    hdr += std::string(i == 16 * 64 + 48 ? "\x80\x80\x80\x95" : "\x80\x80\x80\x81", 4);
  ASSERT_TRUE(write_file_atomic(dir.path() / "sky.hdr", hdr));
  BakeSettings settings;
  settings.environment = (dir.path() / "sky.hdr").string();
  const std::string note = test::note_with(imported(test::small_scene(), settings), "hot spot");
  EXPECT_SAYS(note, "sky.hdr");
  EXPECT_SAYS(note, "100 % of its light");
  EXPECT_SAYS(note, "towards (-0.049, -0.049, 0.998)");
  settings.environment_rotation = 90;  // about +Y: from +z to +x
  EXPECT_SAYS(test::note_with(imported(test::small_scene(), settings), "hot spot"),
              "towards (0.998, -0.049, 0.049)");
}

}  // namespace
}  // namespace kiln

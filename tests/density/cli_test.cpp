// `kiln plan` as a user runs it: the table as JSON, the folder with the heat map, and the same of a bake.
#include <cmath>

#include "common/base/files.h"
#include "coordinator/picture/ramp.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/density/squares.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::json;
using test::kiln_extras;
using test::square_at;
using test::square_meshes;
namespace fs = std::filesystem;

test::CommandResult kiln(const test::TempDir& dir, const std::string& arguments) {
  return test::run_kiln(dir.path(), arguments);
}

json read_json(const fs::path& path) {
  const auto bytes = read_file(path);
  EXPECT_TRUE(bytes) << path;
  return bytes ? json::parse(reinterpret_cast<const char*>(bytes->data()),
                             reinterpret_cast<const char*>(bytes->data()) + bytes->size())
               : json();
}

// Two squares of 16 m beside each other, the right one twice as dense, and a camera above that sees both.
GltfBuilder two_squares() {
  GltfBuilder b = square_meshes(16);
  b.node(square_at("left", -16, 0, -8));
  json right = square_at("right", 0, 0, -8);
  right["extras"] = kiln_extras({{"density", 2}});
  b.node(right);
  b.root["cameras"].push_back(
      {{"name", "above"}, {"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}});
  b.node({{"camera", 0}, {"translation", {0, 20, 0}}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
  return b;
}

TEST(PlanCommand, JsonHasTheTableAndItSumsToTheTotals) {
  test::TempDir dir;
  write_glb_file(two_squares(), dir.path());
  const auto r = kiln(dir, "plan x.glb --layout pack --json -o out 2>/dev/null");
  ASSERT_EQ(r.exit_status, 0) << r.output;
  const json plan = json::parse(r.output);
  EXPECT_EQ(plan, read_json(dir.path() / "out/plan.json"));
  ASSERT_EQ(plan["objects"].size(), 2u);
  uint64_t texels = 0, valid = 0, charts = 0;
  double share = 0;
  for (const json& o : plan["objects"]) {
    texels += o["texels"].get<uint64_t>();
    valid += o["valid_texels"].get<uint64_t>();
    charts += o["charts"].get<uint64_t>();
    share += o["share"].get<double>();
  }
  EXPECT_EQ(texels, plan["chart_texels"].get<uint64_t>());
  EXPECT_EQ(valid, plan["valid_texels"].get<uint64_t>());
  EXPECT_EQ(valid, 65u * 65 + 129 * 129);
  EXPECT_EQ(charts, plan["charts"].get<uint64_t>());
  EXPECT_NEAR(share, 1, 1e-5);
  EXPECT_EQ(plan["objects"][1]["name"], "right");
  EXPECT_NEAR(plan["objects"][1]["texels_per_metre"].get<double>(), 8, 1e-4);
  EXPECT_EQ(plan["texels_per_metre"], 4);
}

// The largest components in a part of the picture: the colour of a face without the squares.
Vec3 brightest(const Texture& png, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1) {
  Vec3 most(0.0f);
  for (uint32_t y = y0; y < y1; ++y)
    for (uint32_t x = x0; x < x1; ++x)
      for (uint32_t c = 0; c < 3; ++c)
        most[static_cast<int>(c)] =
            std::max(most[static_cast<int>(c)],
                     static_cast<float>(png.texels[(size_t{y} * png.width + x) * png.channels + c]));
  return most;
}

TEST(PlanCommand, TheHeatMapShowsTheDensities) {
  test::TempDir dir;
  write_glb_file(two_squares(), dir.path());
  ASSERT_EQ(kiln(dir, "plan x.glb --layout pack --camera above -o out").exit_status, 0);
  const auto bytes = read_file(dir.path() / "out/density.png");
  ASSERT_TRUE(bytes);
  const auto png = decode_image(*bytes, "density.png");
  ASSERT_TRUE(png) << png.error().message;
  ASSERT_EQ(png->width, 1280u);
  ASSERT_EQ(png->height, 776u);
  // The scale runs from 2 to 8 texels per metre: 4 is its middle, 8 its end. Both are seen from straight
  // above beside the middle of the picture, where the shading is within 1 % of full.
  const Vec3 left = brightest(*png, 600, 630, 340, 380), right = brightest(*png, 650, 680, 340, 380);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(left[c], ramp(0.5f)[c], 0.01f * 255 + 1);
    EXPECT_NEAR(right[c], ramp(1.0f)[c], 0.01f * 255 + 1);
  }
  // Squares: a metre is 720 / (2 tan(0.45) 20) = 37 pixels, a texel of the left 9. In a row some are darker.
  uint32_t dark = 0, light = 0;
  for (uint32_t x = 480; x < 640; ++x) {
    const int green = static_cast<int>(png->texels[(size_t{360} * png->width + x) * png->channels + 1]);
    (green < 0.8f * left.y ? dark : light) += 1;
  }
  EXPECT_GT(dark, 50u);
  EXPECT_GT(light, 50u);
  // Numbers under the scale.
  EXPECT_GT(brightest(*png, 500, 560, 754, 770).x, 200.0f);
  const auto page = read_file(dir.path() / "out/plan.html");
  ASSERT_TRUE(page);
  const std::string html(reinterpret_cast<const char*>(page->data()), page->size());
  for (const char* words : {"data:image/png;base64,", "<td>right</td>", "texels per metre", "% empty"})
    EXPECT_NE(html.find(words), std::string::npos) << words;
}

TEST(PlanCommand, TextNamesTheObjectsAndADensityWithoutEffect) {
  test::TempDir dir;
  GltfBuilder b = two_squares();
  write_glb_file(b, dir.path());
  const std::string out = kiln(dir, "plan x.glb --layout pack --importance-box -16,-1,-8:0,1,8:0.5").output;
  EXPECT_SAYS(out, "density     4 texels per metre");
  EXPECT_SAYS(out, "right");
  EXPECT_SAYS(out, "0.5\n");  // the factor of what is inside the box
  b.root["nodes"].erase(0);
  b.root["nodes"][0]["translation"] = {0, 0, 0};
  b.root["scenes"][0]["nodes"] = {0, 1};
  write_glb_file(b, dir.path());
  EXPECT_SAYS(kiln(dir, "plan x.glb --layout atlas --resolution 64").output,
              "densities of objects have no effect on the file's own atlas");
}

TEST(BakeCommand, TheReportHasTheTableToo) {
  test::TempDir dir;
  write_glb_file(two_squares(), dir.path());
  const auto r = kiln(dir,
                      "bake x.glb -o out --layout pack --texels-per-metre 0.5 --environment 1,1,1 "
                      "--min-samples 16 --max-samples 16 --quiet");
  ASSERT_EQ(r.exit_status, 0) << r.output;
  const json report = read_json(dir.path() / "out/report.json");
  ASSERT_EQ(report["objects"].size(), 2u);
  EXPECT_EQ(report["objects"][1]["density_factor"], 2);
  EXPECT_EQ(report["atlas"]["texels_per_metre"], 0.5);
}

TEST(PlanCommand, CamerasOfTheFileSteerTheDensity) {
  test::TempDir dir;
  write_glb_file(two_squares(), dir.path());
  // The camera is 20 m above: half of the density from 10 m on.
  const auto r = kiln(dir, "plan x.glb --layout pack --importance-cameras on --json 2>/dev/null");
  ASSERT_EQ(r.exit_status, 0) << r.output;
  const json objects = json::parse(r.output)["objects"];
  EXPECT_EQ(objects[0]["density_factor"], 0.5);
  EXPECT_EQ(objects[1]["density_factor"], 1);
  EXPECT_EQ(objects[0]["valid_texels"], 33 * 33);
}

TEST(PlanCommand, ACameraThatDoesNotExistIsNamedBesideThoseThatDo) {
  test::TempDir dir;
  GltfBuilder b = two_squares();
  b.root["cameras"][0]["name"] = "above";
  write_glb_file(b, dir.path());
  const auto r = kiln(dir, "plan x.glb --layout pack --camera below 2>&1");
  EXPECT_EQ(r.exit_status, 2);
  EXPECT_NE(r.output.find("--camera below: x.glb has no camera of that name; it has 'above'"),
            std::string::npos)
      << r.output;
  EXPECT_EQ(kiln(dir, "plan x.glb --layout pack --camera above >/dev/null 2>&1").exit_status, 0);
  EXPECT_EQ(kiln(dir, "plan x.glb --layout pack --camera 0,9,0:0,0,1 >/dev/null 2>&1").exit_status, 0);
}

TEST(PlanCommand, PreviewOffWritesNoPictures) {
  test::TempDir dir;
  write_glb_file(two_squares(), dir.path());
  ASSERT_EQ(kiln(dir, "plan x.glb --layout pack --preview off -o plan >/dev/null 2>&1").exit_status, 0);
  EXPECT_FALSE(fs::exists(dir.path() / "plan/density.png"));
  EXPECT_TRUE(fs::exists(dir.path() / "plan/plan.html"));
  const std::string bake =
      "bake x.glb --layout pack --texels-per-metre 1 --min-samples 4 --max-samples 4 --environment 1,1,1 "
      "--encode none ";
  const auto off = kiln(dir, bake + "--preview off -o off --quiet 2>&1");
  ASSERT_EQ(off.exit_status, 0) << off.output;
  EXPECT_EQ(off.output.find("preview.png"), std::string::npos) << off.output;
  EXPECT_FALSE(fs::exists(dir.path() / "off/preview.png"));
  EXPECT_FALSE(fs::exists(dir.path() / "off/validity.png"));
  const Bytes page = *read_file(dir.path() / "off/report.html");
  const std::string_view html(reinterpret_cast<const char*>(page.data()), page.size());
  EXPECT_EQ(html.find("the scene through its lightmap"), html.npos);
  ASSERT_EQ(kiln(dir, bake + "--preview 128x96 -o small >/dev/null 2>&1").exit_status, 0);
  const auto png = decode_image(*read_file(dir.path() / "small/preview.png"), "preview.png");
  ASSERT_TRUE(png);
  EXPECT_EQ(png->height, 96u);
}

// What takes part in what, from the file to the files.
TEST(BakeCommand, ObjectsWithoutTexelsStayInTheSceneWithoutLightmap) {
  test::TempDir dir;
  GltfBuilder b = two_squares();
  b.root["nodes"][1]["extras"] = kiln_extras({{"receive", false}});
  write_glb_file(b, dir.path());
  const auto r =
      kiln(dir,
           "bake x.glb --layout pack --texels-per-metre 1 --min-samples 4 --max-samples 4 --environment "
           "1,1,1 --encode none --instanced on -o out --quiet 2>&1");
  ASSERT_EQ(r.exit_status, 0) << r.output;
  EXPECT_NE(r.output.find("get no texels (extras.kiln.receive): 1 object: 'right'"), std::string::npos)
      << r.output;
  const json report = read_json(dir.path() / "out/report.json");
  EXPECT_EQ(report["objects"][0]["receive"], true);
  EXPECT_EQ(report["objects"][1]["receive"], false);
  EXPECT_EQ(report["objects"][1]["texels"], 0);
  EXPECT_EQ(report["objects"][1]["charts"], 0);
  for (const char* name : {"out/scene.glb", "out/scene_instanced.glb"}) {
    const Bytes glb = *read_file(dir.path() / name);
    const auto length = [&](size_t at) {
      uint32_t v = 0;
      for (size_t k = 4; k-- > 0;) v = v << 8 | static_cast<uint32_t>(glb[at + k]);
      return v;
    };
    const auto* text = reinterpret_cast<const char*>(glb.data()) + 20;
    const json doc = json::parse(text, text + length(12));
    size_t lit = 0, unlit = 0;
    for (const json& node : doc["nodes"]) {
      if (!node.contains("mesh")) continue;
      const json& primitive = doc["meshes"][node["mesh"].get<size_t>()]["primitives"][0];
      const bool marked =
          primitive.contains("extensions") && primitive["extensions"].contains("KILN_lightmap");
      EXPECT_EQ(marked, node["name"] == "left") << name << node;
      ++(marked ? lit : unlit);
    }
    EXPECT_EQ(lit, 1u) << name;
    EXPECT_EQ(unlit, 1u) << name;
  }
}

}  // namespace
}  // namespace kiln

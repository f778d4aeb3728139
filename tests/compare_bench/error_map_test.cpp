// Folders of bakes and lone files, whole and damaged.
#include "coordinator/measure/compare/error_map.h"

#include <fstream>

#include "coordinator/measure/compare/places.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

class ErrorMaps : public testing::Test {
 protected:
  void write(const std::string& name, uint32_t width,
             std::vector<std::pair<std::string, std::vector<float>>> planes) {
    std::vector<ExrChannel> channels;
    for (const auto& plane : planes) channels.push_back({plane.first, plane.second.data()});
    ASSERT_TRUE(write_exr(dir_.path() / name, width, static_cast<uint32_t>(planes[0].second.size()) / width,
                          channels));
  }
  void write_light(const std::string& name, std::vector<float> y) {
    write(name, 2, {{"R", y}, {"G", y}, {"B", y}, {"A", std::vector<float>(y.size(), 1)}});
  }
  std::string trouble(const std::string& name = "") {
    const auto map = read_error_map(dir_.path() / name);
    return map ? "" : map.error().message;
  }
  bool says(const std::string& what) { return trouble().find(what) != std::string::npos; }

  test::TempDir dir_;
};

TEST_F(ErrorMaps, OfAFolder) {
  write_light("irradiance.exr", {1, 2, 3, 4});
  write("error.exr", 2, {{"Y", {0.1f, 0.2f, 0, INFINITY}}});
  write("validity.exr", 2, {{"Y", {1, 2, 3, 5}}});
  const auto map = *read_error_map(dir_.path());
  EXPECT_EQ(map.width, 2u);
  EXPECT_NEAR(map.light[2], 3, 1e-6);
  EXPECT_NEAR(map.stated[1], 0.2, 1e-6);
  EXPECT_EQ(map.measured, std::vector<bool>({true, true, false, false}));
}

TEST_F(ErrorMaps, OfSeveralPages) {
  write_light("irradiance.0.exr", {1, 2});
  write_light("irradiance.1.exr", {3, 4});
  const auto map = *read_error_map(dir_.path());
  EXPECT_EQ(map.pages, 2u);
  EXPECT_EQ(map.page_height, 1u);
  EXPECT_NEAR(map.light[3], 4, 1e-6);
  write("error.0.exr", 2, {{"Y", {0, 0}}});
  EXPECT_TRUE(says("1 pages of error, 2 of irradiance"));
}

TEST_F(ErrorMaps, NonsenseIsNamed) {
  EXPECT_TRUE(says("has no irradiance.exr"));
  write_light("irradiance.exr", {1, NAN, 3, 4});
  EXPECT_TRUE(says("texel (1, 0) is nan"));
  write("validity.exr", 2, {{"Y", {1, 4, 1, 1}}});
  EXPECT_EQ(trouble(), "");  // what was dilated does not count
  write("error.exr", 2, {{"Y", {0, 0, -1, 0}}});
  EXPECT_TRUE(says("stated error of texel (0, 1) is -1"));
  write("error.exr", 1, {{"Y", {0, 0}}});
  EXPECT_TRUE(says("1x2 texels"));
  write("error.exr", 2, {{"X", {0, 0, 0, 0}}, {"Y", {0, 0, 0, 0}}});
  EXPECT_TRUE(says("has X Y: one channel"));
  write("irradiance.exr", 2, {{"L0.R", {1, 1}}, {"L0.G", {1, 1}}});
  EXPECT_TRUE(says("has L0.G L0.R: a map of light has R, G and B"));
  std::ofstream(dir_.path() / "irradiance.exr") << "no EXR";
  EXPECT_NE(trouble(), "");
  EXPECT_NE(trouble("none.exr").find("none.exr"), std::string::npos);
}

TEST_F(ErrorMaps, TexelsAreNamedByTheirObjects) {
  std::ofstream(dir_.path() / "charts.json") << R"({"width": 10, "height": 10,
    "instances": [{"name": "box", "first_chart": 0, "charts": 1}, {"name": "floor", "first_chart": 1, "charts": 1}],
    "transforms": [[0.2, 0.2, 0.5, 0.5, 0, 1], [0.9, 0.9, 0, 0, 0, 0]]})";
  std::vector<WorstTexel> texels(3);
  texels[0].x = texels[0].y = 6;
  texels[1].x = texels[1].y = 2;
  texels[2].x = texels[2].y = 9;
  name_places(dir_.path(), texels);
  EXPECT_EQ(texels[0].object, "box");
  EXPECT_EQ(texels[1].object, "floor");
  EXPECT_EQ(texels[2].object, "");
  for (const char* nonsense : {"{", "[]", R"({"width": "x", "height": 1, "transforms": 3, "instances": {}})",
                               R"({"width": 9, "height": 9, "transforms": [[1], 7], "instances": [4]})"}) {
    std::ofstream(dir_.path() / "charts.json") << nonsense;
    std::vector<WorstTexel> unnamed(1);
    name_places(dir_.path(), unnamed);
    EXPECT_EQ(unnamed[0].object, "");
  }
}

}  // namespace
}  // namespace kiln

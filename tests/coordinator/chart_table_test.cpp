// charts.json: what is written reads back as it was, and what others wrote is checked.
#include "coordinator/output/chart_table/chart_table.h"

#include <cstdlib>
#include <functional>

#include "common/base/files.h"
#include "tests/bake/scene_gltf.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::json;

class ChartTableFile : public testing::Test {
 protected:
  ChartTableFile() {
    AtlasSettings settings;
    settings.layout = AtlasSettings::Layout::kPack;
    settings.texels_per_metre = 3.7f;  // numbers that need all their digits
    atlas_ = *build_atlas(scene_, settings);
    text_ = charts_json(scene_, atlas_);
    root_ = json::parse(text_);
  }
  Expected<KeptLayout> read(const std::string& text) {
    EXPECT_TRUE(write_file_atomic(dir_.path() / "charts.json", text));
    return read_layout(dir_.path() / "charts.json");
  }

  Scene scene_ = test::small_room();
  Atlas atlas_;
  std::string text_;
  json root_;
  test::TempDir dir_;
};

TEST_F(ChartTableFile, NumbersReadBackAsTheSameFloats) {
  const std::vector<ChartTransform> transforms = chart_transforms(atlas_);
  ASSERT_EQ(root_["transforms"].size(), transforms.size());
  for (size_t i = 0; i < transforms.size(); ++i) {
    const json& row = root_["transforms"][i];
    const ChartTransform& t = transforms[i];
    const float expected[4] = {t.scale.x, t.scale.y, t.offset.x, t.offset.y};
    for (size_t k = 0; k < 4; ++k) EXPECT_EQ(static_cast<float>(row[k].get<double>()), expected[k]);
    EXPECT_EQ(row[4], t.page);
    EXPECT_EQ(row[5], t.turned);
  }
  ASSERT_EQ(root_["instances"].size(), scene_.instances.size());
  for (size_t i = 0; i < scene_.instances.size(); ++i) {
    const json& in = root_["instances"][i];
    EXPECT_EQ(in["name"], scene_.instances[i].name);
    EXPECT_EQ(in["first_chart"], atlas_.instance_first_chart[i]);
    const json& set = root_["chart_sets"][in["chart_set"].get<size_t>()];
    EXPECT_EQ(set["charts"], in["charts"]);
    EXPECT_EQ(set["mesh"], scene_.meshes[scene_.instances[i].mesh].name);
  }
}

TEST_F(ChartTableFile, TransformsLieOnThePage) {
  for (const ChartTransform& t : chart_transforms(atlas_))
    for (int k = 0; k < 2; ++k)
      for (const float end : {t.offset[k], t.offset[k] + t.scale[k]})
        EXPECT_TRUE(end >= 0 && end <= 1) << end;
}

TEST_F(ChartTableFile, TheLayoutReadsBackAsItWas) {
  const auto kept = read(text_);
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(kept->digest, sha256(bytes_of(std::string_view(text_))));
  const PreviousLayout expected = previous_layout_of(scene_, atlas_);
  EXPECT_EQ(kept->layout.width, expected.width);
  EXPECT_EQ(kept->layout.height, expected.height);
  EXPECT_EQ(kept->layout.pages, expected.pages);
  ASSERT_EQ(kept->layout.objects.size(), expected.objects.size());
  for (size_t i = 0; i < expected.objects.size(); ++i) {
    const PreviousLayout::Object &a = kept->layout.objects[i], &b = expected.objects[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.pose, b.pose);
    EXPECT_EQ(bytes_of(a.charts).size(), bytes_of(b.charts).size());
    EXPECT_TRUE(std::ranges::equal(bytes_of(a.charts), bytes_of(b.charts)));
  }
}

TEST_F(ChartTableFile, WhatIsWrongIsNamed) {
  struct Case {
    const char* field;
    std::function<void(json&)> spoil;
  };
  const Case cases[] = {
      {"format is", [](json& r) { r = json::array(); }},
      {"format is", [](json& r) { r["format"] = 3; }},
      {"version is 2", [](json& r) { r["version"] = 2; }},
      {"width is missing", [](json& r) { r.erase("width"); }},
      {"width is 0", [](json& r) { r["width"] = 0; }},
      {"height is 4294967295", [](json& r) { r["height"] = 4294967295u; }},
      {"pages is 65", [](json& r) { r["pages"] = 65; }},
      {"pages is not a whole number", [](json& r) { r["pages"] = -1; }},
      {"layout is not an array", [](json& r) { r.erase("layout"); }},
      {"instances is not an array", [](json& r) { r["instances"] = "none"; }},
      {"layout[2] is not [key", [](json& r) { r["layout"][2] = 7; }},
      {"layout[2] is not [key", [](json& r) { r["layout"][2].push_back(7); }},
      {"layout[0][0] is not 16", [](json& r) { r["layout"][0][0] = "12x4567890123456"; }},
      {"layout[0][0] is not 16", [](json& r) { r["layout"][0][0] = "12"; }},
      {"layout[0][0] is not 16", [](json& r) { r["layout"][0][0] = 12; }},
      {"layout[1][1] is 100000", [](json& r) { r["layout"][1][1] = 100000; }},
      {"layout[1][2] is not a whole", [](json& r) { r["layout"][1][2] = 0.5; }},
      {"layout[1][3] is 1", [](json& r) { r["layout"][1][3] = 1; }},
      {"layout[1][4] is 2", [](json& r) { r["layout"][1][4] = 2; }},
      {"instances[1] is not an object", [](json& r) { r["instances"][1] = nullptr; }},
      {"instances[1].key is not a text", [](json& r) { r["instances"][1].erase("key"); }},
      {"instances[1].pose is missing", [](json& r) { r["instances"][1].erase("pose"); }},
      {"instances[0].charts is not a whole", [](json& r) { r["instances"][0]["charts"] = 1e30; }},
      {"instances[0].first_chart 0 and its 4294967295",
       [](json& r) { r["instances"][0]["charts"] = 4294967295u; }},
      {"instances[1].first_chart 0 and", [](json& r) { r["instances"][1]["first_chart"] = 0; }},
      {"layout has", [](json& r) { r["instances"].erase(r["instances"].size() - 1); }},
  };
  for (const Case& c : cases) {
    json root = root_;
    c.spoil(root);
    const auto kept = read(root.dump());
    ASSERT_FALSE(kept) << c.field;
    EXPECT_EQ(kept.error().kind, ErrorKind::kInvalidInput);
    EXPECT_SAYS(kept.error().message, std::string("charts.json: ") + c.field);
    EXPECT_SAYS(kept.error().message, "--keep-layout");
  }
  EXPECT_SAYS(read(text_.substr(0, text_.size() / 2)).error().message, "its JSON does not parse");
  EXPECT_SAYS(read(std::string(1 << 20, '[')).error().message, "its JSON does not parse");
  EXPECT_FALSE(read_layout(dir_.path() / "absent.json"));
}

}  // namespace
}  // namespace kiln

// What viewers that know MOZ_lightmap or EPIC_lightmap_textures make of scene.glb, texel by texel.
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/files.h"
#include "coordinator/output/encode/output.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/scene/import/import.h"
#include "tests/atlas/shapes.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

using json = nlohmann::json;

struct Glb {
  json doc;
  Bytes bin;

  explicit Glb(const Bytes& file) {
    uint32_t length = 0;
    std::memcpy(&length, &file[12], 4);
    const char* text = reinterpret_cast<const char*>(&file[20]);
    doc = json::parse(text, text + length);
    bin.assign(file.begin() + 28 + length, file.end());
  }
  // Of a glTF texture.
  Texture image(const json& texture) const {
    const json& view =
        doc["bufferViews"]
           [doc["images"][doc["textures"][texture.get<size_t>()]["source"].get<size_t>()]["bufferView"]
                .get<size_t>()];
    const size_t begin = view.value("byteOffset", size_t{0}), length = view["byteLength"];
    return *decode_image(std::span(bin).subspan(begin, length), "image");
  }
};

class Fallbacks : public testing::Test {
 protected:
  // Light over six powers of ten, on every texel of a chart.
  Fallbacks() {
    test::write_scene_glb(test::small_room(), dir_.path() / "room.glb");
    imported_ = std::make_unique<ImportResult>(*import_scene(dir_.path() / "room.glb", {}));
    AtlasSettings layout;
    layout.layout = AtlasSettings::Layout::kPack;
    layout.texels_per_metre = 8;
    layout.max_page_size = 64;  // several pages
    atlas_ = *build_atlas(imported_->scene, layout);
    settings_.basis = "irradiance";
    settings_.gltf_lightmap = {true, true, true, true};
    Planes& p = map_.planes;
    map_.page_height = atlas_.height;
    p.width = atlas_.width;
    p.height = atlas_.height * atlas_.pages;
    for (const char* name : {"E.R", "E.G", "E.B", "error", "samples"}) p.add(name);
    test::Random random(5);
    map_.validity.assign(atlas_.owner.size(), Validity::kEmpty);
    for (size_t t = 0; t < atlas_.owner.size(); ++t) {
      if (!atlas_.owner[t]) continue;
      map_.validity[t] = Validity::kMeasured;
      const double level = std::exp2(20 * random.next() - 10);
      for (size_t c = 0; c < 3; ++c) p.data[c][t] = static_cast<float>(level * (0.2 + 0.8 * random.next()));
    }
    EXPECT_TRUE(write_gltf({settings_, imported_->scene, atlas_, imported_->document, map_, dir_.path()}));
    glb_ = std::make_unique<Glb>(*read_file(dir_.path() / "scene.glb"));
  }
  size_t texel(uint32_t page, size_t in_page) const {
    return page * size_t{atlas_.width} * atlas_.height + in_page;
  }

  test::TempDir dir_;
  std::unique_ptr<ImportResult> imported_;
  Atlas atlas_;
  Lightmap map_;
  BakeSettings settings_;
  std::unique_ptr<Glb> glb_;
};

TEST_F(Fallbacks, MozTexelsTimesIntensityAreIrradiance) {
  ASSERT_GT(atlas_.pages, 1u);
  std::set<std::pair<size_t, uint32_t>> seen;  // texture, page
  for (const json& mesh : glb_->doc["meshes"])
    for (const json& primitive : mesh["primitives"]) {
      const json& material = glb_->doc["materials"][primitive["material"].get<size_t>()];
      const json& moz = material["extensions"]["MOZ_lightmap"];
      EXPECT_EQ(moz["texCoord"], 1);
      seen.insert(
          {moz["index"].get<size_t>(), primitive["extensions"]["KILN_lightmap"]["page"].get<uint32_t>()});
    }
  EXPECT_EQ(seen.size(), atlas_.pages) << "one image a page, and primitives use their page's";
  const double intensity = glb_->doc["materials"][0]["extensions"]["MOZ_lightmap"]["intensity"];
  size_t cut = 0, count = 0;
  for (const auto& [texture, page] : seen) {
    const Texture image = glb_->image(texture);
    ASSERT_EQ(image.width, atlas_.width);
    ASSERT_EQ(image.height, atlas_.height);
    for (size_t i = 0; i < size_t{atlas_.width} * atlas_.height; ++i) {
      if (map_.validity[texel(page, i)] != Validity::kMeasured) continue;
      bool beyond = false;
      for (size_t c = 0; c < 3; ++c) {
        const double e = map_.planes.data[c][texel(page, i)];
        const double got = std::to_integer<int>(image.texels[i * image.channels + c]) / 255.0 * intensity;
        beyond |= e > intensity;
        ASSERT_NEAR(got, std::min(e, intensity), intensity * 0.5 / 255 * (1 + 1e-6));
      }
      cut += beyond;
      ++count;
    }
  }
  EXPECT_LE(cut, count / 1000 + 1);  // the share that docs/gltf.md states
}

// By the formula of Unreal's readers (docs/gltf.md): L = 2^(v span + low) - 0.01858136 with v from both
// halves' alpha, E/pi = 0.6 L rgb^2.
TEST_F(Fallbacks, UnrealsLayoutReadsBack) {
  const json& lightmaps = glb_->doc["extensions"]["EPIC_lightmap_textures"]["lightmaps"];
  ASSERT_EQ(lightmaps.size(), atlas_.pages);
  for (uint32_t page = 0; page < atlas_.pages; ++page) {
    const json& m = lightmaps[page];
    const double span = m["lightmapScale"][3], low = m["lightmapAdd"][3];
    const Texture image = glb_->image(m["texture"]["index"]);
    const size_t count = size_t{atlas_.width} * atlas_.height;
    ASSERT_EQ(image.height, 2 * atlas_.height);
    const auto byte = [&](size_t t, size_t c) { return std::to_integer<int>(image.texels[4 * t + c]); };
    for (size_t i = 0; i < count; ++i) {
      if (map_.validity[texel(page, i)] != Validity::kMeasured) continue;
      const double v = (byte(i, 3) + byte(count + i, 3) / 255.0 - 0.5) / 255;
      const double light = std::exp2(v * span + low) - 0.01858136;
      double most = 0;
      for (size_t c = 0; c < 3; ++c) most = std::max(most, double{map_.planes.data[c][texel(page, i)]});
      // Half a step of the low byte in the exponent; the logarithm begins at black.
      const double exponent = 0.5 / 255 / 255 * span * std::log(2.0) * 1.01;
      const double slack = exponent * (most + 0.6 * kPi * 0.01858136);
      for (size_t c = 0; c < 3; ++c) {
        const double root = byte(i, c) / 255.0, e = map_.planes.data[c][texel(page, i)];
        const double step = most * (2 * std::sqrt(e / most) * 0.5 / 255 + 0.25 / 255 / 255);
        ASSERT_NEAR(0.6 * kPi * light * root * root, e, slack + step * 1.01) << i;
      }
    }
  }
  for (const json& node : glb_->doc["nodes"])
    if (node.contains("mesh")) {
      EXPECT_TRUE(node["extensions"].contains("EPIC_lightmap_textures"));
    }
}

// By the shader of its specification: E = 34.49 a^2.2 rgb x intensity. Nothing is clipped.
TEST_F(Fallbacks, RgbmOfThirdRoomReadsBack) {
  std::set<std::pair<size_t, uint32_t>> seen;  // texture, page
  double intensity = 0;
  for (const json& node : glb_->doc["nodes"]) {
    if (!node.contains("mesh")) continue;
    const json& mx = node["extensions"]["MX_lightmap"];
    EXPECT_EQ(mx["lightMapTexture"]["texCoord"], 1);
    EXPECT_EQ(mx["scale"], json({1.0, 1.0}));
    EXPECT_EQ(mx["offset"], json({0.0, 0.0}));
    intensity = mx["intensity"];
    for (const json& primitive : glb_->doc["meshes"][node["mesh"].get<size_t>()]["primitives"])
      seen.insert({mx["lightMapTexture"]["index"].get<size_t>(),
                   primitive["extensions"]["KILN_lightmap"]["page"].get<uint32_t>()});
  }
  EXPECT_EQ(seen.size(), atlas_.pages) << "one image a page, and nodes show their page's";
  for (const auto& [texture, page] : seen) {
    const Texture image = glb_->image(texture);
    ASSERT_EQ(image.channels, 4u);
    const auto byte = [&](size_t t, size_t c) { return std::to_integer<int>(image.texels[4 * t + c]); };
    for (size_t i = 0; i < size_t{atlas_.width} * atlas_.height; ++i) {
      if (map_.validity[texel(page, i)] != Validity::kMeasured) continue;
      ASSERT_GT(byte(i, 3), 0);
      const double scale = 34.49 * std::pow(byte(i, 3) / 255.0, 2.2) * intensity;
      double most = 0;
      for (size_t c = 0; c < 3; ++c) {
        const double e = map_.planes.data[c][texel(page, i)];
        most = std::max(most, e);
        ASSERT_NEAR(scale * byte(i, c) / 255, e, scale * 0.5 / 255 * 1.0001) << i;
      }
      // The least alpha that is enough, so that rgb is as fine as it may be.
      if (byte(i, 3) > 1) {
        ASSERT_LT(34.49 * std::pow((byte(i, 3) - 1) / 255.0, 2.2) * intensity, most * 1.0001);
      }
    }
  }
}

// Every other texel has a quarter of the light: (1/4)^(1/2.2) of 255 is 135.8, and the next alpha holds it.
TEST_F(Fallbacks, RgbmHoldsMapsNearTheEndsOfFloat) {
  for (const float level : {1e-42f, 1e33f}) {
    for (size_t c = 0; c < 3; ++c)
      for (size_t t = 0; t < map_.validity.size(); ++t) map_.planes.data[c][t] = t % 2 ? level : level / 4;
    ASSERT_TRUE(write_gltf({settings_, imported_->scene, atlas_, imported_->document, map_, dir_.path()}));
    const Glb glb(*read_file(dir_.path() / "scene.glb"));
    std::set<int> alphas;
    for (const json& node : glb.doc["nodes"]) {
      if (!node.contains("mesh")) continue;
      const json& mx = node["extensions"]["MX_lightmap"];
      EXPECT_NEAR(mx["intensity"].get<double>() * 34.49 / level, 1, 1e-6);
      const Texture image = glb.image(mx["lightMapTexture"]["index"]);
      for (size_t i = 3; i < image.texels.size(); i += 4)
        alphas.insert(std::to_integer<int>(image.texels[i]));
    }
    EXPECT_EQ(alphas, (std::set<int>{1, 136, 255}));  // 1: without light
  }
}

TEST_F(Fallbacks, AreLeftOutWhenNotAskedFor) {
  settings_.gltf_lightmap = {false, false, false, false};
  ASSERT_TRUE(write_gltf({settings_, imported_->scene, atlas_, imported_->document, map_, dir_.path()}));
  const Glb plain(*read_file(dir_.path() / "scene.glb"));
  EXPECT_EQ(plain.doc.dump().find("lightmap_textures"), std::string::npos);
  EXPECT_EQ(plain.doc.dump().find("MOZ_lightmap"), std::string::npos);
  EXPECT_EQ(plain.doc.dump().find("MX_lightmap"), std::string::npos);
  EXPECT_EQ(plain.doc.dump().find("KILN_lightmap"), std::string::npos);
  EXPECT_FALSE(plain.doc.contains("images"));
}

// No object may come to be null: glTF has no such value.
TEST_F(Fallbacks, AFileWithoutMaterialsGetsNoneThatAreNothing) {
  Glb room(*read_file(dir_.path() / "room.glb"));
  room.doc.erase("materials");
  for (json& mesh : room.doc["meshes"])
    for (json& primitive : mesh["primitives"]) primitive.erase("material");
  ASSERT_TRUE(write_file_atomic(dir_.path() / "bare.glb", write_glb(room.doc.dump(), room.bin)));
  const auto bare = import_scene(dir_.path() / "bare.glb", {});
  ASSERT_TRUE(bare) << bare.error().message;
  for (const bool moz : {false, true}) {
    settings_.gltf_lightmap = {true, moz, moz, moz};
    ASSERT_TRUE(write_gltf({settings_, bare->scene, atlas_, bare->document, map_, dir_.path()}));
    const Glb written(*read_file(dir_.path() / "scene.glb"));
    EXPECT_EQ(written.doc.dump().find(":null"), std::string::npos);
    EXPECT_EQ(written.doc.contains("materials"), moz);
  }
}

}  // namespace
}  // namespace kiln

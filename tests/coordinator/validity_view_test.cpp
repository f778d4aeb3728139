// The validity view: every surface in the colour of its texel's class.
#include "coordinator/report/validity_view.h"

#include "coordinator/picture/label.h"
#include "coordinator/picture/raster.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

constexpr Validity kAll[] = {Validity::kEmpty,  Validity::kMeasured, Validity::kPushed,
                             Validity::kFilled, Validity::kDilated,  Validity::kInside};

struct Room {
  ImportResult imported;
  Atlas atlas;
  Lightmap map;
  Camera camera;

  Room() {
    imported.scene = test::small_room();
    AtlasSettings settings;
    settings.layout = AtlasSettings::Layout::kPack;
    atlas = *build_atlas(imported.scene, settings);
    map.page_height = atlas.height;
    map.planes.width = atlas.width;
    map.planes.height = atlas.height * atlas.pages;
    map.validity.assign(atlas.texel_count(), Validity::kEmpty);
    camera.to_world[3] = Vec3(1.5f, 1, 3.9f);  // in the room, along -z: surfaces fill the picture
    camera.vertical_fov = 1;
  }
};

TEST(ValidityView, SurfacesHaveTheColourOfTheirClass) {
  Room room;
  for (const Validity v : kAll) {
    std::fill(room.map.validity.begin(), room.map.validity.end(), v);
    const Picture p = validity_scene(room.imported, room.atlas, room.map, room.camera, 48, 32);
    const auto color = class_color(v);
    for (size_t i = 0; i < p.rgb.size(); i += 3) {
      // Shading scales a colour by 0.4 to 1; magenta is always full.
      const int top = std::max({p.rgb[i], p.rgb[i + 1], p.rgb[i + 2]});
      const int full = std::max({color[0], color[1], color[2]});
      EXPECT_GE(top, v == Validity::kInside ? full : static_cast<int>(0.4 * full));
      for (size_t c = 0; c < 3; ++c)  // one half for the rounding of each of the two bytes
        EXPECT_NEAR(p.rgb[i + c] * full, color[c] * top, 0.5 * full + 0.5 * color[c]) << int(v);
    }
  }
}

TEST(ValidityView, OnlyTheObjectInsideIsMagenta) {
  Room room;
  std::fill(room.map.validity.begin(), room.map.validity.end(), Validity::kMeasured);
  const View view = rasterise(room.imported.scene, room.camera, 96 * kSupersample, 64 * kSupersample,
                              [](const Fragment& f) { return !f.back; });
  const uint32_t target = view.fragments[view.fragments.size() / 2 + view.width / 2].instance;
  for (size_t t = 0; t < room.atlas.owner.size(); ++t)
    if (room.atlas.owner[t] > room.atlas.instance_first_chart[target] &&
        room.atlas.owner[t] <= room.atlas.instance_first_chart[target + 1])
      room.map.validity[t] = Validity::kInside;
  const Picture p = validity_scene(room.imported, room.atlas, room.map, room.camera, 96, 64);
  size_t magenta = 0;
  for (uint32_t y = 0; y < 64; ++y)
    for (uint32_t x = 0; x < 96; ++x) {
      size_t of_it = 0;
      for (uint32_t k = 0; k < 4; ++k)
        of_it += view.fragments[size_t{2 * y + k / 2} * view.width + 2 * x + k % 2].instance == target;
      const uint8_t* rgb = &p.rgb[(size_t{y} * 96 + x) * 3];
      const bool full = rgb[0] == 255 && rgb[1] == 0 && rgb[2] == 255;
      EXPECT_EQ(full, of_it == 4) << x << " " << y;
      magenta += full;
    }
  EXPECT_GT(magenta, 20u);
}

TEST(ValidityView, ASheetShowsEveryTexelOfEveryPage) {
  Lightmap map;
  map.page_height = 3;
  map.planes.width = 4;
  map.planes.height = 9;
  const Picture p = page_sheet(map, 24, [](size_t t) {
    return std::array<uint8_t, 3>{static_cast<uint8_t>(t), 1, 2};
  });
  ASSERT_EQ(p.width, 24u);  // two pages of 4 texels, 3 pixels each; the third below
  ASSERT_EQ(p.height, 18u);
  for (uint32_t y = 0; y < 18; ++y)
    for (uint32_t x = 0; x < 24; ++x) {
      const uint32_t page = y / 9 * 2 + x / 12;
      if (page == 3) continue;
      EXPECT_EQ(p.rgb[(size_t{y} * 24 + x) * 3], (page * 3 + y % 9 / 3) * 4 + x % 12 / 3);
    }
}

TEST(ValidityView, LabelsAreCutOffAtThePicture) {
  Picture p(9, 9, 0);
  draw_label(p, 4, 4, 2, "inside 42 ?", {1, 2, 3});
  EXPECT_EQ(std::count(p.rgb.begin(), p.rgb.end(), 2), 5);  // of the i: 2 of its dot, 3 below
}

}  // namespace
}  // namespace kiln

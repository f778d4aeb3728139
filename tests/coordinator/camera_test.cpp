// Where pictures are seen from: rays against every triangle one by one, the two ways to see a view against
// each other, cameras that are asked for, and what a chosen one shows.
#include "coordinator/report/camera.h"

#include "coordinator/report/density_view.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/report/view_score.h"
#include "coordinator/scene/sight/scene_rays.h"
#include "tests/atlas/shapes.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {
using test::Random;

Scene with_materials(Scene scene) {
  Record material;
  material.type = "metallic_roughness";
  if (scene.materials.empty()) scene.materials.push_back(material);
  return scene;
}

// Copies of a soup and of a sphere: turned, mirrored, stretched.
Scene many_places() {
  Scene scene = with_materials(test::scene_of({test::soup(200, 5), test::sphere(8, 1)}));
  Mat4x3 odd = test::at({3, 1, -2});
  odd[0] = Vec3(0.5f, 0.5f, 0);
  odd[1] = Vec3(-1, 2, 0.25f);
  odd[2] = Vec3(0, 0, -3);
  scene.instances.push_back(test::instance(0, "mirrored", odd));
  scene.instances.push_back(test::instance(1, "flat", odd));
  return scene;
}

// Moeller & Trumbore in double over all triangles.
bool nearest(const Scene& scene, const Vec3& o, const Vec3& d, RayHit& best, double& second) {
  double least = 1e300;
  second = 1e300;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      DVec3 c[3];
      for (int k = 0; k < 3; ++k)
        c[k] = DVec3(transform_point(scene.instances[i].to_world, mesh.positions[mesh.triangles[t][k]]));
      const DVec3 e1 = c[1] - c[0], e2 = c[2] - c[0], p = cross(DVec3(d), e2), s = DVec3(o) - c[0],
                  q = cross(s, e1);
      const double det = dot(e1, p), u = dot(s, p) / det, v = dot(DVec3(d), q) / det, at = dot(e2, q) / det;
      if (!(u >= 0 && v >= 0 && u + v <= 1 && at > 0)) continue;
      if (at < least) {
        second = least;
        least = at;
        const bool mirrored = determinant(scene.instances[i].to_world) < 0;
        best = {static_cast<float>(at), i, t, static_cast<float>(u), static_cast<float>(v),
                (det < 0) != mirrored};
      } else {
        second = std::min(second, at);
      }
    }
  }
  return least < 1e300;
}

TEST(SceneRays, MeetWhatEveryTriangleOneByOneSays) {
  const Scene scene = many_places();
  const SceneRays rays(scene);
  Random random(3);
  size_t hits = 0;
  for (int k = 0; k < 8000; ++k) {  // one in ten meets something
    const auto number = [&] { return static_cast<float>(random.next() * 2 - 1); };
    const Vec3 o(number() * 15, number() * 5, number() * 5), d(number(), number(), number());
    RayHit expected, hit;
    double second;
    const bool there = nearest(scene, o, d, expected, second);
    const bool found = rays.closest(o, d, 1e30f, hit);
    if (there != found) {  // a graze: in float a side may go to either
      EXPECT_LT(std::min({expected.b1, expected.b2, 1 - expected.b1 - expected.b2}), 1e-4f);
      continue;
    }
    if (!found) continue;
    ++hits;
    if (hit.instance != expected.instance || hit.triangle != expected.triangle) {
      const bool graze = std::min({expected.b1, expected.b2, 1 - expected.b1 - expected.b2}) < 1e-4f;
      EXPECT_TRUE(graze || second - expected.distance < 1e-4 * second) << k;
      continue;
    }
    EXPECT_NEAR(hit.distance, expected.distance, 1e-3f * expected.distance);
    EXPECT_EQ(hit.back, expected.back);
  }
  EXPECT_GT(hits, 500u);
}

// Boxes small and large, so that few or many triangles reach into them, and planes below the rays in them.
TEST(SceneRays, MeetTheSameAmongNearTrianglesAsInTheScene) {
  const Scene scene = many_places();
  const SceneRays rays(scene);
  Random random(7);
  const auto number = [&] { return static_cast<float>(random.next() * 2 - 1); };
  const auto triple = [&] { return Vec3(number(), number(), number()); };
  size_t empty = 0, blocked = 0, above = 0;
  for (int k = 0; k < 8000; ++k) {
    const Vec3 centre = triple() * Vec3(6, 3, 3), half(0.05f + std::abs(number()) * (k % 10 ? 0.5f : 5.0f));
    const bool has_plane = k % 2;
    const DVec3 normal = has_plane ? normalize(DVec3(triple())) : DVec3(0.0);
    const double offset = has_plane ? dot(normal, DVec3(centre)) : 0.0;
    BoxNode box;
    box.add(centre - half);
    box.add(centre + half);
    const SceneRays::NearTriangles near = rays.near_triangles(box, normal, offset);
    empty += near.empty();
    for (int r = 0; r < 16; ++r) {
      const Vec3 from = centre + triple() * half, to = centre + triple() * half;
      if (dot(normal, DVec3(from)) < offset || dot(normal, DVec3(to)) < offset) continue;
      const bool in_scene = rays.is_blocked(from, to - from, 1);
      blocked += in_scene;
      above += has_plane && in_scene;
      EXPECT_EQ(near.is_blocked(from, to - from, 1), in_scene) << k;
    }
  }
  EXPECT_GT(empty, 300u);
  EXPECT_GT(blocked, 1000u);
  EXPECT_GT(above, 200u);
}

TEST(Rasteriser, ShowsWhatRaysThroughItsPixelsMeet) {
  const Scene scene = many_places();
  const SceneRays rays(scene);
  const Camera camera = look_along({6, 3, 9}, {-0.4f, -0.3f, -1}, 0.9f, "");
  const View view = rasterise(scene, camera, 160, 90, [](const Fragment&) { return true; });
  const float tall = std::tan(0.45f), wide = tall * 160 / 90;
  size_t seen = 0, other = 0;
  for (uint32_t y = 0; y < 90; ++y)
    for (uint32_t x = 0; x < 160; ++x) {
      const Vec3 local(wide * ((static_cast<float>(x) + 0.5f) / 80 - 1),
                       tall * (1 - (static_cast<float>(y) + 0.5f) / 45), -1);
      RayHit hit;
      const bool found =
          rays.closest(camera.to_world[3], transform_vector(camera.to_world, local), 1e30f, hit);
      const Fragment& f = view.fragments[y * 160 + x];
      seen += found;
      other += found != (f.inverse_depth > 0) ||
               (found && (hit.instance != f.instance || hit.triangle != f.triangle || hit.back != f.back));
    }
  EXPECT_GT(seen, 1000u);
  EXPECT_LT(other, seen / 200) << "only at sides of triangles may rounding decide";
}

struct Place {
  ImportResult imported;
  Atlas atlas;
  Lightmap map;

  explicit Place(Scene scene) {
    imported.document.path = "place.glb";
    imported.scene = with_materials(std::move(scene));
    AtlasSettings settings;
    settings.layout = AtlasSettings::Layout::kPack;
    atlas = *build_atlas(imported.scene, settings);
    map = unbaked_lightmap(atlas);
  }
};

TEST(Camera, IsTheOneThatIsAskedFor) {
  Place place(test::small_room());
  for (const char* name : {"hall", "door"}) place.imported.cameras.push_back({Mat4x3(1.0f), 0.7f, name});
  place.imported.cameras[1].to_world[3] = Vec3(1, 2, 3);
  const auto asked = [&](const std::string& wish) {
    return preview_camera(place.imported, place.atlas, place.map, wish);
  };
  EXPECT_EQ(asked("door")->to_world[3], Vec3(1, 2, 3));
  const Camera there = *asked("1,2,3:1,2,-7:90");
  EXPECT_EQ(there.to_world[3], Vec3(1, 2, 3));
  EXPECT_EQ(there.to_world[2], Vec3(0, 0, 1));
  EXPECT_NEAR(there.vertical_fov, 1.5707963f, 1e-6f);
  EXPECT_NEAR(asked("0,0,0:1,0,0")->vertical_fov, 1.0f, 1e-6f);
  for (const char* wrong : {"window", "1,2,3", "1,2,3:4,5", "1,2,3:1,2,3", "0,0,0:1,0,0:0", "0,0,0:1,0,0:171",
                            "0,0,0:1,0,0:50:2", "0,0,0:1,0,nan"}) {
    const auto refused = asked(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().kind, ErrorKind::kUsage);
    EXPECT_FALSE(check_camera(place.imported, wrong));
  }
  EXPECT_NE(asked("window").error().message.find("it has 'hall', 'door'"), std::string::npos);
  EXPECT_TRUE(check_camera(place.imported, ""));
}

// One that looks at nothing is passed over, one that sees the room is taken.
TEST(Camera, OfTheFileIsTakenIfItShowsSomething) {
  Place place(test::small_room());
  const Camera blind = look_along({500, 500, 500}, {1, 1, 1}, 0.7f, "blind");
  const Camera sees = look_along({1.5f, 1, 3.9f}, {0, 0, -1}, 1.0f, "sees");
  place.imported.cameras = {blind, sees};
  EXPECT_EQ(preview_camera(place.imported, place.atlas, place.map)->name, "sees");
  place.imported.cameras = {blind};
  EXPECT_EQ(preview_camera(place.imported, place.atlas, place.map)->name, "chosen");
}

TEST(Camera, IsChosenInsideAClosedRoomWithThingsInView) {
  Place place(test::small_room());
  const Camera camera = choose_camera(place.imported, place.atlas, place.map);
  EXPECT_EQ(camera.to_world, choose_camera(place.imported, place.atlas, place.map).to_world);
  Vec3 low(1e9f), high(-1e9f);
  for (const Instance& i : place.imported.scene.instances)
    for (const Vec3& p : place.imported.scene.meshes[i.mesh].positions) {
      low = glm::min(low, transform_point(i.to_world, p));
      high = glm::max(high, transform_point(i.to_world, p));
    }
  const Vec3 eye = camera.to_world[3];
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(eye[k] > low[k] && eye[k] < high[k]) << k;
  const View view = rasterise(place.imported.scene, camera, 64, 36, [](const Fragment&) { return true; });
  std::vector<uint32_t> objects;
  size_t back = 0;
  for (const Fragment& f : view.fragments) {
    back += f.back;
    if (f.inverse_depth > 0) objects.push_back(f.instance);
  }
  EXPECT_LT(back * 20, view.fragments.size());
  std::sort(objects.begin(), objects.end());
  objects.erase(std::unique(objects.begin(), objects.end()), objects.end());
  EXPECT_GE(objects.size(), std::min<size_t>(3, place.imported.scene.instances.size()));
}

// A wall before the lens is worth less than the same view with more in it.
TEST(Camera, ScoresVarietyAboveABlankWall) {
  std::vector<Sight> wall(400, {Sight::Kind::kFront, 1.0f, 0, 0, 1.0f}), varied = wall, dark = wall,
                                                                         back = wall;
  for (uint32_t i = 0; i < varied.size(); ++i) {
    varied[i] = {Sight::Kind::kFront, 1.0f + static_cast<float>(i % 7), i / 20, i / 20, i % 3 ? 1.0f : 0.2f};
    dark[i] = varied[i];
    dark[i].light = 0;
    back[i] = varied[i];
    if (i % 2) back[i].kind = Sight::Kind::kBack;
  }
  EXPECT_GT(view_score(varied, 1, 10), 3 * view_score(wall, 1, 10));
  EXPECT_GT(view_score(varied, 1, 10), 3 * view_score(dark, 1, 10));
  EXPECT_GT(view_score(varied, 1, 10), 3 * view_score(back, 1, 10));
  EXPECT_EQ(view_score(std::vector<Sight>(10), 1, 10), 0);
  EXPECT_FALSE(shows_something(wall));
  EXPECT_TRUE(shows_something(varied));
  EXPECT_FALSE(shows_something(std::vector<Sight>(10)));
}

TEST(Pictures, HaveTheSizeThatIsAskedForAndCanBeOff) {
  Place place(test::small_room());
  const test::TempDir dir;
  BakeSettings settings;
  settings.preview_width = 96;
  settings.preview_height = 64;
  const auto on = write_pictures(dir.path(), place.imported, place.atlas, place.map, settings);
  ASSERT_TRUE(on);
  EXPECT_TRUE(std::filesystem::exists(dir.path() / "preview.png"));
  const auto number = [&](size_t at) {
    uint32_t v = 0;
    for (size_t k = 0; k < 4; ++k) v = v << 8 | static_cast<uint32_t>(on->preview[at + k]);
    return v;
  };
  EXPECT_GT(number(16), 96u);  // width of a PNG: the scene, and beside it the atlas
  EXPECT_EQ(number(20), 64u);
  const test::TempDir other;
  settings.preview = false;
  const auto off = write_pictures(other.path(), place.imported, place.atlas, place.map, settings);
  ASSERT_TRUE(off);
  EXPECT_TRUE(off->preview.empty() && off->validity.empty() && off->density.empty());
  EXPECT_TRUE(std::filesystem::is_empty(other.path()));
}

}  // namespace
}  // namespace kiln

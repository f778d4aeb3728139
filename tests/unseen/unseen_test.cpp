// Who is reached by cameras, lamps and openings: slabs around a room, things on a floor, and what the layout
// makes of it. A chart is told by where the middle of its faces looks.
#include "coordinator/scene/unseen/unseen.h"

#include "tests/unseen/world.h"

namespace kiln {
namespace {
using test::Box;
using test::kRoom;
using test::kThick;
using test::lit_room;
using test::World;

struct Placed {
  std::string object;
  Vec3 middle, normal;
  bool unseen;
  uint64_t texels;  // of its box as it would be
};

AtlasSettings settings_of(float density, bool cuts = true) {
  AtlasSettings s = test::pack_at(density);
  s.cut_contacts = cuts;
  s.unwrap.cache.clear();
  return s;
}

std::vector<Placed> judge(const World& world, const std::vector<Viewpoint>& cameras = {}, bool cuts = true) {
  const UnseenCharts unseen(world.scene, cameras);
  std::vector<Placed> placed;
  AtlasSettings settings = settings_of(4, cuts);
  settings.collapse = [&](const ChartsToSize& charts) {
    const std::vector<uint8_t> flags = unseen.find(charts);
    placed.assign(flags.size(), {});
    std::vector<float> area(flags.size(), 0);
    for (uint32_t i = 0; i < world.scene.instances.size(); ++i) {
      const Instance& instance = world.scene.instances[i];
      const MeshCharts& set = charts.atlas.of_instance(i);
      for (size_t f = 0; f < set.face_count(); ++f) {
        const size_t p = charts.atlas.instance_first_chart[i] + set.chart_of_face[f];
        Vec3 c[3];
        face_corners(world.scene.meshes[instance.mesh], set, f, c);
        if (area2(uv_triangle(set, f)) == 0) continue;
        const float a = length(cross(c[1] - c[0], c[2] - c[0]));
        area[p] += a;
        placed[p].middle += a * transform_point(instance.to_world, (c[0] + c[1] + c[2]) / 3.0f);
        placed[p].normal = front_normal(instance.to_world, c);
        placed[p].object = instance.name;
      }
    }
    for (size_t p = 0; p < flags.size(); ++p) {
      placed[p].middle /= area[p];
      placed[p].unseen = flags[p];
      placed[p].texels = charts.texels[p];
    }
    return flags;
  };
  EXPECT_TRUE(build_atlas(world.scene, settings));
  EXPECT_FALSE(placed.empty());
  return placed;
}

// Counts charts whose middle looks into the box and that are (not) unseen.
struct Counts {
  int seen = 0, unseen = 0;
};
template <class Where>
Counts count(const std::vector<Placed>& placed, const Where& where) {
  Counts n;
  for (const Placed& p : placed)
    if (where(p)) ++(p.unseen ? n.unseen : n.seen);
  return n;
}
Counts facing_into(const std::vector<Placed>& placed, const Box& box) {
  return count(placed, [&](const Placed& p) { return box.holds(p.middle + 0.02f * p.normal); });
}
Counts facing_out_of(const std::vector<Placed>& placed, const Box& box) {
  return count(placed, [&](const Placed& p) { return !box.holds(p.middle + 0.02f * p.normal); });
}
Counts of_object(const std::vector<Placed>& placed, const std::string& name) {
  return count(placed, [&](const Placed& p) { return p.object == name; });
}

TEST(Unseen, TheFacesBetweenTwoWallsAre) {
  const Box cavity = kRoom.grown(0.5f);  // 0.2 m of wall, 0.3 m of air
  for (const uint32_t material : {0u, 1u})
    for (const bool cuts : {true, false}) {
      World world;
      world.room(kRoom, "inner", true, material);
      world.room(cavity, "outer", true, material);
      world.light("point", Vec3(2, 2, 2));
      world.light("environment");
      const auto placed = judge(world, {}, cuts);
      EXPECT_EQ(facing_into(placed, kRoom).unseen, 0);
      EXPECT_GE(facing_into(placed, kRoom).seen, 6);
      EXPECT_EQ(facing_out_of(placed, cavity.grown(kThick)).unseen, 0);
      EXPECT_GE(facing_out_of(placed, cavity.grown(kThick)).seen, 6);
      const Counts between = count(placed, [&](const Placed& p) {
        if (p.texels <= 4) return false;  // nothing to gain: not asked
        const Vec3 at = p.middle + 0.02f * p.normal;
        return cavity.grown(0.02f).holds(at) && !kRoom.grown(0.02f).holds(at);
      });
      EXPECT_EQ(between.seen, 0) << "material " << material << ", cuts " << cuts;
      EXPECT_GE(between.unseen, 12);
    }
}

TEST(Unseen, AClosedRoomWithALampIsSeenInsideAndOnlyThere) {
  World world;
  world.room(kRoom, "room");
  world.light("spot", Vec3(2, 2.5f, 2));
  const Box outer = kRoom.grown(kThick);
  auto placed = judge(world);
  EXPECT_EQ(facing_into(placed, kRoom).unseen, 0);
  EXPECT_GE(facing_into(placed, kRoom).seen, 6);
  EXPECT_EQ(facing_out_of(placed, outer).seen, 0);
  EXPECT_GE(facing_out_of(placed, outer).unseen, 6);
  world.light("directional");
  placed = judge(world);
  EXPECT_EQ(facing_out_of(placed, outer).unseen, 0);
  EXPECT_EQ(facing_into(placed, kRoom).unseen, 0);
}

// Flush with the ceiling, like a lamp in it; an area light is no sky.
TEST(Unseen, AClosedRoomWithAnAreaLightIsSeenInsideAndOnlyThere) {
  for (const char* type : {"rectangle", "disc"}) {
    SCOPED_TRACE(type);
    World world;
    world.room(kRoom, "room");
    world.light(type);
    Record& light = world.scene.lights.back();
    light.to_world = Mat4x3(Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(0, 1, 0), Vec3(3, 3, 3));
    light.properties = {{"size", {1, 0.5}, "", {}}, {"sides", {1}, "", {}}};
    if (light.type == "disc") light.properties[0] = {"radius", {0.4}, "", {}};
    const auto placed = judge(world);
    EXPECT_EQ(facing_into(placed, kRoom).unseen, 0);
    EXPECT_GE(facing_into(placed, kRoom).seen, 6);
    EXPECT_EQ(facing_out_of(placed, kRoom.grown(kThick)).seen, 0);
    EXPECT_GE(facing_out_of(placed, kRoom.grown(kThick)).unseen, 6);
  }
}

TEST(Unseen, ACameraSeesADarkRoom) {
  World world;
  world.room(kRoom, "room");
  world.light("environment");
  EXPECT_EQ(facing_into(judge(world), kRoom).seen, 0);
  Viewpoint camera;
  camera.to_world = test::at(Vec3(3, 1, 1));
  EXPECT_EQ(facing_into(judge(world, {camera}), kRoom).unseen, 0);
  EXPECT_EQ(facing_out_of(judge(world, {camera}), kRoom.grown(kThick)).unseen, 0);
}

TEST(Unseen, AnOpenRoomIsSeenOnAllSides) {
  World world;
  world.room(kRoom, "room", false);
  world.light("point", Vec3(2, 2, 2));
  const auto placed = judge(world);
  EXPECT_EQ(facing_into(placed, kRoom).unseen, 0);
  EXPECT_EQ(facing_out_of(placed, kRoom.grown(kThick)).unseen, 0);
}

// Through a slit of 2 cm in the roof: 1/800 of the surface.
TEST(Unseen, ASlitLetsARoomBeSeen) {
  for (const float slit : {0.02f, 0.0f}) {
    World world;
    world.room(kRoom, "room", false);
    Box roof = kRoom.grown(kThick / 2);
    roof.low.y = kRoom.high.y;
    const Vec3 far = roof.high;
    roof.high.x = 2;
    world.solid(roof, "roof");
    roof = {Vec3(2 + slit, roof.low.y, roof.low.z), far};
    world.solid(roof, "roof");
    world.light("environment");
    const Counts n = facing_into(judge(world), kRoom);
    EXPECT_EQ(slit > 0 ? n.unseen : n.seen, 0);
  }
}

// Nine tiles of 2 m, a cabinet on the middle one.
World tiles(float height, uint32_t material = 0) {
  World world;
  for (int x = 0; x < 3; ++x)
    for (int z = 0; z < 3; ++z)
      world.add(test::plane(1, 2, test::Uv::kUnit), x == 1 && z == 1 ? "under" : "tile",
                Vec3(2.0f * static_cast<float>(x), 0, 2.0f * static_cast<float>(z)));
  world.solid({Vec3(1.9f, height, 1.9f), Vec3(4.1f, height + 1, 4.1f)}, "cabinet", material);
  world.light("environment");
  return world;
}

TEST(Unseen, AFloorUnderACabinetIs) {
  const auto foot = [](const Placed& p) { return p.object == "cabinet" && p.normal.y < -0.5f; };
  for (const bool cuts : {true, false})
    for (const uint32_t material : {0u, 1u}) {
      const auto placed = judge(tiles(0, material), {}, cuts);
      EXPECT_EQ(of_object(placed, "under").seen, 0) << "cuts " << cuts << ", material " << material;
      const Counts open = count(placed, [](const Placed& p) {
        return p.object == "tile" && (std::abs(p.middle.x - 3) > 1.1f || std::abs(p.middle.z - 3) > 1.1f);
      });
      EXPECT_EQ(open.unseen, 0);
      EXPECT_GE(open.seen, 8);
      EXPECT_EQ(count(placed, [&](const Placed& p) { return p.object == "cabinet" && !foot(p); }).unseen, 0);
      if (!material) EXPECT_EQ(count(placed, foot).seen, 0);
    }
  const auto hovers = judge(tiles(0.1f));
  EXPECT_EQ(of_object(hovers, "under").unseen, 0);
  EXPECT_EQ(count(hovers, foot).unseen, 0);
}

TEST(Unseen, ABoxReachingOutOfAWallByAHandIsSeen) {
  World world;
  world.solid({Vec3(0.0f), Vec3(4, 3, 1)}, "wall");
  world.solid({Vec3(1, 1, 0.2f), Vec3(3, 1.1f, 1.1f)}, "shelf");  // its top: 0.1 m of 0.9 m are outside
  world.light("environment");
  const auto placed = judge(world, {}, false);
  EXPECT_GE(count(placed, [](const Placed& p) { return p.object == "shelf" && p.normal.y > 0.5f; }).seen, 1);
  EXPECT_EQ(count(placed, [](const Placed& p) { return p.object == "shelf" && p.normal.z < -0.5f; }).seen, 0);
}

// Light comes up into a hood without a bottom, but the backs of its walls throw none down again.
TEST(Unseen, BacksOfSingleSidedSurfacesShowNothing) {
  for (const uint32_t material : {0u, 1u}) {
    World world;
    Mesh hood = test::box(Vec3(4, 3, 4), test::Uv::kUnit);
    hood.triangles.erase(hood.triangles.begin() + 4, hood.triangles.begin() + 6);
    world.add(std::move(hood), "hood", Vec3(0.0f), material);
    world.solid({Vec3(1, 1, 1), Vec3(3, 2, 3)}, "crate");
    world.light("environment");
    const auto placed = judge(world);
    const Counts top =
        count(placed, [](const Placed& p) { return p.object == "crate" && p.normal.y > 0.5f; });
    EXPECT_EQ(material ? top.unseen : top.seen, 0);
    const Counts foot =
        count(placed, [](const Placed& p) { return p.object == "crate" && p.normal.y < -0.5f; });
    EXPECT_EQ(foot.unseen, 0);
  }
}

TEST(Unseen, NothingIsWhereThereIsNeitherCameraNorLight) {
  World world;
  world.room(kRoom, "room");
  EXPECT_FALSE(UnseenCharts(world.scene, {}).decides());
  EXPECT_EQ(count(judge(world), [](const Placed& p) { return p.unseen; }).unseen, 0);
}

// Texels of each chart by its owner in the atlas.
std::vector<uint64_t> texels_of(const Atlas& atlas) {
  std::vector<uint64_t> texels(atlas.placements.size(), 0);
  for (const uint32_t owner : atlas.owner)
    if (owner) ++texels[owner - 1];
  return texels;
}

TEST(UnseenLayout, UnseenChartsHaveFourTexelsAndOthersTheirOwn) {
  const World world = lit_room();
  const UnseenCharts unseen(world.scene, {});
  AtlasSettings settings = settings_of(4);
  const Atlas keep = *build_atlas(world.scene, settings);
  EXPECT_EQ(keep.statistics.collapsed[kUnseen].charts, 0u);
  settings.collapse = [&](const ChartsToSize& charts) { return unseen.find(charts); };
  const Atlas atlas = *build_atlas(world.scene, settings);
  const std::vector<uint64_t> before = texels_of(keep), after = texels_of(atlas);
  ASSERT_EQ(before.size(), after.size());
  uint64_t charts = 0, from = 0, to = 0;
  for (size_t p = 0; p < before.size(); ++p) {
    if (!atlas.collapsed[p]) {
      EXPECT_EQ(after[p], before[p]) << p;
      continue;
    }
    EXPECT_LE(after[p], 4u) << p;
    ++charts;
    from += before[p];
    to += after[p];
  }
  EXPECT_GE(charts, 6u);
  EXPECT_EQ(atlas.statistics.collapsed[kUnseen].charts, charts);
  EXPECT_EQ(atlas.statistics.collapsed[kUnseen].from, from);
  EXPECT_EQ(atlas.statistics.collapsed[kUnseen].texels, to);
  EXPECT_LT(atlas.texel_count(), 0.8 * static_cast<double>(keep.texel_count()));
}

TEST(UnseenLayout, IsTheSameForAnyNumberOfThreads) {
  const World world = lit_room();
  std::vector<Bytes> atlases;
  for (const unsigned threads : {1u, 2u, 7u}) {
    const UnseenCharts unseen(world.scene, {}, threads);
    AtlasSettings settings = settings_of(8);
    settings.threads = threads;
    settings.collapse = [&](const ChartsToSize& charts) { return unseen.find(charts); };
    atlases.push_back(write_atlas(*build_atlas(world.scene, settings)));
  }
  EXPECT_EQ(atlases[0], atlases[1]);
  EXPECT_EQ(atlases[0], atlases[2]);
}

TEST(UnseenLayout, WhereNothingCollapsesTheLayoutIsBitForBitThatWithout) {
  const World world = lit_room();
  for (const uint64_t budget : {0u, 4000u})
    for (const bool cuts : {true, false}) {
      AtlasSettings settings = settings_of(4, cuts);
      settings.texel_budget = budget;
      const Bytes keep = write_atlas(*build_atlas(world.scene, settings));
      settings.collapse = [](const ChartsToSize& charts) {
        return std::vector<uint8_t>(charts.texels.size(), 0);
      };
      EXPECT_EQ(write_atlas(*build_atlas(world.scene, settings)), keep);
    }
}

TEST(UnseenLayout, ABudgetIsSpentOnWhatIsSeen) {
  const World world = lit_room();
  const UnseenCharts unseen(world.scene, {});
  AtlasSettings settings = settings_of(64);
  settings.texel_budget = 6000;
  const Atlas keep = *build_atlas(world.scene, settings);
  settings.collapse = [&](const ChartsToSize& charts) { return unseen.find(charts); };
  const Atlas atlas = *build_atlas(world.scene, settings);
  EXPECT_LE(atlas.texel_count(), 6000u);
  EXPECT_GT(atlas.statistics.texels_per_metre, 1.2f * keep.statistics.texels_per_metre);
}

}  // namespace
}  // namespace kiln

// Which surfaces count as standing on others, and how charts are cut there.
#include "common/contacts/contacts.h"

#include "common/atlas/atlas.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

using test::SceneMaker;

constexpr double kTexel = 0.25;

struct Floor {
  SceneMaker maker;
  uint32_t white = maker.lambert(Vec3(0.7f));
  Floor() { maker.quad({0, 0, 0}, {0, 0, 8}, {8, 0, 0}, white); }

  Atlas build(unsigned threads = 0) {
    AtlasSettings a;
    a.layout = AtlasSettings::Layout::kPack;
    a.texels_per_metre = static_cast<float>(1 / kTexel);
    a.threads = threads;
    auto atlas = build_atlas(maker.scene(), a);
    EXPECT_TRUE(atlas) << atlas.error().message;
    return std::move(*atlas);
  }
  uint32_t charts() { return build().of_instance(0).chart_count; }
};

// The chart of the floor at (x, z).
uint32_t chart_at(const Atlas& atlas, double x, double z) {
  const MeshCharts& charts = atlas.of_instance(0);
  for (size_t f = 0; f < charts.face_count(); ++f) {
    DVec2 p[3];
    for (int k = 0; k < 3; ++k) {
      const DVec2 b(charts.parts.empty() ? Vec2(k == 1, k == 2) : charts.parts[f].corner[k]);
      const bool second = charts.triangle_of(f) == 1;  // quad: (0,0) (0,8) (8,8) and (0,0) (8,8) (8,0)
      p[k] = second ? DVec2(8 * (b.x + b.y), 8 * b.x) : DVec2(8 * b.y, 8 * (b.x + b.y));
    }
    const auto side = [&](int k) {
      const DVec2 &a = p[k], &b = p[(k + 1) % 3];
      return (b.x - a.x) * (z - a.y) - (b.y - a.y) * (x - a.x);
    };
    if ((side(0) >= 0) == (side(1) >= 0) && (side(1) >= 0) == (side(2) >= 0)) return charts.chart_of_face[f];
  }
  ADD_FAILURE() << "no face at " << x << " " << z;
  return 0;
}

double area_of(const MeshCharts& charts) {
  double area = 0;
  for (size_t f = 0; f < charts.face_count(); ++f) {
    const FacePart& p = charts.parts[f];
    const DVec2 e1(p.corner[1] - p.corner[0]), e2(p.corner[2] - p.corner[0]);
    area += 32 * (e1.x * e2.y - e1.y * e2.x);
  }
  return area;
}

TEST(Contacts, AWallThatGoesThroughPartsTheFloor) {
  Floor f;
  f.maker.quad({3.1f, -1, -1}, {0, 0, 10}, {0, 3, 0}, f.white);
  const Atlas atlas = f.build();
  EXPECT_EQ(atlas.of_instance(0).chart_count, 2u);
  EXPECT_NE(chart_at(atlas, 3.0, 5), chart_at(atlas, 3.2, 5));
  EXPECT_NEAR(area_of(atlas.of_instance(0)), 64, 64e-6);
}

TEST(Contacts, AWallThatEndsInTheMiddleHasTwoSides) {
  Floor f;
  f.maker.quad({3.1f, 0, -1}, {0, 0, 6}, {0, 3, 0}, f.white);  // to z = 5
  const Atlas atlas = f.build();
  EXPECT_NE(chart_at(atlas, 3.0, 4.9), chart_at(atlas, 3.2, 4.9));
}

TEST(Contacts, AWallThatHoversByAHairOrLeansCounts) {
  for (const float gap : {0.0f, 1e-6f, 1e-3f, 4e-3f}) {
    Floor f;
    f.maker.quad({3.1f, gap, -1}, {0, 0, 10}, {0.5f, 3, 0}, f.white);
    const Atlas atlas = f.build();
    EXPECT_NE(chart_at(atlas, 3.09, 5), chart_at(atlas, 3.11, 5)) << gap;
  }
}

TEST(Contacts, WhatDoesNotPartIsLeft) {
  Floor low, high, small, leaf, solid, below;
  EXPECT_EQ(low.charts(), 1u);
  low.maker.quad({3, 0, -1}, {0, 0, 10}, {0, 0.005f, 0}, low.white);  // a sill
  EXPECT_EQ(low.charts(), 1u);
  high.maker.quad({3, 0.1f, -1}, {0, 0, 10}, {0, 3, 0}, high.white);  // light passes below
  EXPECT_EQ(high.charts(), 1u);
  small.maker.quad({3, 0, 3}, {0, 0, 0.4f}, {0, 3, 0}, small.white);  // less than two texels long
  EXPECT_EQ(small.charts(), 1u);
  Record curtain = leaf.maker.scene().materials[0];
  curtain.properties.push_back({"alpha_mode", {}, "blend", {}});
  leaf.maker.scene().materials.push_back(curtain);
  leaf.maker.quad({3, 0, -1}, {0, 0, 10}, {0, 3, 0}, 1);
  EXPECT_EQ(leaf.charts(), 1u);
  solid.maker.box({2, 0, 2}, {5, 2, 5}, false, solid.white);  // no lookup reaches from one side to another
  EXPECT_EQ(solid.charts(), 1u);
  below.maker.quad({3, -3, -1}, {0, 0, 10}, {0, 3, 0}, below.white);
  EXPECT_EQ(below.charts(), 1u);
}

TEST(Contacts, TheSameForAnyThreadsAndFarFromTheOrigin) {
  Floor f;
  f.maker.box({3.1f, -0.1f, -1}, {3.2f, 3, 9}, false, f.white);
  f.maker.quad({0, 0, 5.3f}, {3.1f, 0, 0}, {0, 3, 0}, f.white);
  const Bytes one = write_atlas(f.build(1)), two = write_atlas(f.build(2));
  EXPECT_EQ(one, two);
  const uint32_t here = f.charts();
  EXPECT_EQ(here, 3u);  // two to the left of the wall, one to its right
  for (Instance& i : f.maker.scene().instances) i.to_world[3] = Vec3(1024, -512, 2048);
  EXPECT_EQ(f.charts(), here);
}

// A wall that ends a hair before the floor's border: the border stays straight, or a crack as wide as the
// hair opens to what lies beside it, and shows as a dark line.
TEST(Contacts, BordersStayStraight) {
  for (const float hair : {1e-5f, 2e-5f, 4e-5f}) {
    Floor f;
    f.maker.box({4, -1, 2}, {4.1f, 1, 8 - hair}, false, f.white);
    const Atlas atlas = f.build();
    ASSERT_FALSE(atlas.of_instance(0).parts.empty());
    EXPECT_NEAR(area_of(atlas.of_instance(0)), 64, 1e-9) << hair;
  }
}

TEST(Contacts, AForestOfWallsIsRefusedWithItsName) {
  Floor f;
  for (int i = 0; i < 24; ++i) {
    const float at = 0.1f + 0.33f * static_cast<float>(i);
    f.maker.quad({at, 0, -1}, {0, 0, 10}, {0, 3, 0}, f.white);
    f.maker.quad({-1, 0, at}, {10, 0, 0}, {0, 3, 0}, f.white);
  }
  const Atlas atlas = f.build();
  EXPECT_EQ(atlas.of_instance(0).chart_count, 1u);
  ASSERT_FALSE(atlas.warnings.empty());
  EXPECT_NE(atlas.warnings.back().find("'mesh0'"), std::string::npos) << atlas.warnings.back();
}

// Copies of a room on one place: each floor has one line for a wall, not one for each copy of it.
TEST(Contacts, CopiesOnOnePlaceMakeOneContactEach) {
  const auto contacts_of_each = [](size_t copies) {
    Floor f;
    f.maker.quad({3.1f, -1, -1}, {0, 0, 10}, {0, 3, 0}, f.white);
    f.maker.quad({0, 0, 5.3f}, {3.1f, 0, 0}, {0, 3, 0}, f.white);
    const std::vector<Instance> room = f.maker.scene().instances;
    for (size_t i = 1; i < copies; ++i)
      f.maker.scene().instances.insert(f.maker.scene().instances.end(), room.begin(), room.end());
    const std::vector<double> texel(room.size() * copies, kTexel);
    const Contacts contacts = ContactFinder(f.maker.scene(), texel, 2).find();
    EXPECT_FALSE(contacts.given_up);
    for (size_t i = 0; i < contacts.of_instance.size(); ++i)
      EXPECT_EQ(contacts.of_instance[i].size(), contacts.of_instance[i % room.size()].size()) << i;
    EXPECT_EQ(f.charts(), 3u);
    return contacts.of_instance[0].size();
  };
  const size_t one = contacts_of_each(1);
  EXPECT_GE(one, 4u);
  EXPECT_EQ(contacts_of_each(2), one);
  EXPECT_EQ(contacts_of_each(400), one);
}

// Copies that are a hair apart lie in each other's reach all the same: a count, not a time, ends that.
TEST(Contacts, TooManyPairsAreGivenUp) {
  Floor f;
  for (int i = 0; i < 400; ++i)
    f.maker.quad({3.1f + 1e-5f * static_cast<float>(i), -1, -1}, {0, 0, 10}, {0, 3, 0}, f.white);
  const std::vector<double> texel(f.maker.scene().instances.size(), kTexel);
  for (const unsigned threads : {1u, 2u}) {
    const ContactFinder finder(f.maker.scene(), texel, threads);
    const Contacts none = finder.find({}, 0);
    EXPECT_TRUE(none.given_up);
    EXPECT_TRUE(none.lines.empty());
    const Contacts all = finder.find();
    EXPECT_FALSE(all.given_up);
    EXPECT_FALSE(all.lines.empty());
  }
}

}  // namespace
}  // namespace kiln

// Projection on its own: which side, which distance, which errors, no cracks.
#include <array>
#include <map>

#include "tests/lods/crate.h"

namespace kiln {
namespace {
using namespace test;

Mat4x3 placed(const Vec3& to, const Vec3& scale = Vec3(1.0f)) {
  return Mat4x3(Vec3(scale.x, 0, 0), Vec3(0, scale.y, 0), Vec3(0, 0, scale.z), to);
}

struct Baked {
  Scene scene;
  Atlas atlas;
};
Baked baked(const Mesh& mesh, std::vector<Mat4x3> places = {Mat4x3(1.0f)}, float density = 16) {
  Baked b;
  b.scene.meshes = {mesh};
  b.scene.materials.push_back({"metallic_roughness", "grey", Mat4x3(1.0f), {}});
  for (const Mat4x3& m : places) {
    Instance i;
    i.to_world = m;
    i.name = "crate " + std::to_string(b.scene.instances.size());
    b.scene.instances.push_back(i);
  }
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = density;
  auto atlas = build_atlas(b.scene, settings);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  b.atlas = *atlas;
  return b;
}

// Where the lookup of a display point reads: found among all faces of the baked scene by texels.
std::optional<LitPoint> read_place(const Baked& b, const AtlasPlace& place) {
  for (uint32_t i = 0; i < b.scene.instances.size(); ++i) {
    const MeshCharts& charts = b.atlas.of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const uint32_t placement = b.atlas.instance_first_chart[i] + charts.chart_of_face[f];
      if (placement != place.placement) continue;
      const Triangle2 t = texel_triangle(charts, b.atlas.placements[placement], f);
      const double all = area2(t);
      const double b1 = area2(t.c[0], place.texels, t.c[2]) / all,
                   b2 = area2(t.c[0], t.c[1], place.texels) / all;
      if (std::min({b1, b2, 1 - b1 - b2}) < -1e-4) continue;
      Vec3 c[3];
      face_corners(b.scene.meshes[0], charts, f, c);
      const Mat4x3& m = b.scene.instances[i].to_world;
      LitPoint p;
      p.at = DVec3(transform_point(m, c[0] * static_cast<float>(1 - b1 - b2) + c[1] * static_cast<float>(b1) +
                                          c[2] * static_cast<float>(b2)));
      p.normal = DVec3(normalize_or(transform_normal(m, cross(c[1] - c[0], c[2] - c[0])), Vec3(0)));
      p.placement = i;  // the instance, here
      return p;
    }
  }
  return std::nullopt;
}

Projection projected(const Baked& b, const Display& display, const LodSettings& settings = {}) {
  auto p = project_display(display, b.scene, b.atlas, settings);
  if (!p) throw std::runtime_error(p.error().message);
  return *p;
}
std::string refused(const Baked& b, const Display& display, const LodSettings& settings = {}) {
  const auto p = project_display(display, b.scene, b.atlas, settings);
  EXPECT_FALSE(p);
  if (p) return {};
  EXPECT_EQ(p.error().kind, ErrorKind::kInvalidInput);
  return p.error().message;
}
void expect_says(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

// Every point reads a place of `instance` no further than `metres` whose face looks the same way.
void expect_right_places(const Baked& b, const Display& display, const ProjectedCharts& charts,
                         uint32_t instance, double metres) {
  size_t outside = 0, read = 0;
  for (size_t f = 0; f < charts.charts.face_count(); ++f)
    for (const auto& [b1, b2] :
         {std::pair{0.34, 0.33}, {0.02, 0.02}, {0.9, 0.05}, {0.05, 0.9}, {0.45, 0.45}}) {
      const DisplayPoint q = display_point(display, charts, f, b1, b2);
      const auto place = read_place(b, projected_place(b.atlas, charts, f, b1, b2));
      outside += !place;  // within a texel of the border of a chart
      if (!place) continue;
      ++read;
      EXPECT_EQ(place->placement, instance);
      EXPECT_LT(length(place->at - q.at), metres) << q.at.x << " " << q.at.y << " " << q.at.z;
      EXPECT_GT(dot(place->normal, q.facing), 0.0);
    }
  EXPECT_GT(read, 0u);
  EXPECT_LT(outside * 20, read);
}

TEST(Projection, ALevelOfTheSameShapeReadsItsOwnPlaces) {
  const Baked b = baked(crate_level(0));
  const Display d = display_of(crate_level(0), Mat4x3(1.0f));
  const Projection p = projected(b, d);
  EXPECT_LT(p.fits[0].worst, 1e-6);
  EXPECT_EQ(p.fits[0].faces, p.fits[0].triangles);
  expect_right_places(b, d, p.charts[0], 0, 1e-4);
}

TEST(Projection, DistancesAreThoseOfTheShapes) {
  // A plain box around a box of one size less: each face is 1 cm off, and its edges 1.41 cm, corners 1.73 cm.
  const Baked b = baked(crate(Vec3(0.98f), 0, 0));
  const Projection p = projected(b, display_of(crate(Vec3(1.0f), 0, 0), Mat4x3(1.0f)));
  EXPECT_NEAR(p.fits[0].worst, 0.01 * std::sqrt(3.0), 1e-6);
  EXPECT_GE(p.fits[0].mean, 0.01);
  EXPECT_LT(p.fits[0].mean, 0.012);
  EXPECT_NEAR(p.fits[0].limit, kLodDistance * 0.98 * std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(p.fits[0].worst_texels, 16 * p.fits[0].worst, 1);
}

TEST(Projection, TheUpperSideOfASlabDoesNotTakeTheLowerSidesTexels) {
  // 4 mm thick: the display's upper side, 10 mm lower, is nearer to the baked lower side than to the upper
  // one.
  const Baked b = baked(crate(Vec3(1, 0.004f, 1), 0, 0));
  const Display d = display_of(crate(Vec3(1, 0.004f, 1), 0, 0), placed({0, -0.01f, 0}));
  const Projection p = projected(b, d);
  expect_right_places(b, d, p.charts[0], 0, 0.02);
}

TEST(Projection, SurfacesThatFaceAwayAreRefused) {
  // A quad just above a baked quad that looks the other way.
  Mesh quad;
  quad.name = "quad";
  quad.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}};
  quad.normals.assign(4, Vec3(0, 1, 0));
  quad.triangles = {{0, 1, 2}, {0, 2, 3}};
  quad.source_triangle = {0, 1};
  const Baked b = baked(quad);
  for (UVec3& t : quad.triangles) std::swap(t.y, t.z);
  for (Vec3& n : quad.normals) n = -n;
  const std::string why = refused(b, display_of(quad, placed({0, 0.001f, 0})));
  expect_says(why, "'crate_low' (level 1 of node 0 'crate') against level 0");
  expect_says(why, "no baked surface within 0.0707 m faces its way");
  expect_says(why, "turned by more than 60 degrees");
}

TEST(Projection, ALevelThatIsFarOffIsRefusedWithItsNamePlaceAndDistance) {
  const Baked b = baked(crate_level(0));
  Display d = display_of(crate_level(2), placed({1, 0, 0}));
  const std::string why = refused(b, d);
  expect_says(why, "'crate_low' (level 1 of node 0 'crate')");
  expect_says(why, "at (1.500, ");
  expect_says(why, "the baked surface is 1 m away");
  expect_says(why, "0.0866 m are allowed");
  expect_says(why, "--lod-distance");
  // All that do not fit are named, and those that do are not.
  d.shown.push_back(d.shown[0]);
  d.shown[1].place.name = "crate_fits";
  d.shown[1].place.to_world = Mat4x3(1.0f);
  d.shown.push_back(d.shown[0]);
  d.shown[2].place.name = "crate_lowest";
  const std::string both = refused(b, d);
  expect_says(both, "crate_low'");
  expect_says(both, "crate_lowest");
  EXPECT_EQ(both.find("crate_fits"), std::string::npos);
}

TEST(Projection, DistancesCanBeWidenedAndNarrowed) {
  const Baked b = baked(crate_level(0));
  Display d = display_of(crate_level(2), placed({0.07f, 0, 0}));
  EXPECT_FALSE(refused(b, d).empty());
  LodSettings settings;
  settings.distance = 0.2;
  EXPECT_DOUBLE_EQ(projected(b, d, settings).fits[0].limit, 0.2);
  d.sets[0].most_distance = 0.01;  // the node's own goes before
  expect_says(refused(b, d, settings), "0.01 m are allowed");
  d.sets[0].most_distance = 0.3;
  settings.distance = 0.01;
  EXPECT_DOUBLE_EQ(projected(b, d, settings).fits[0].limit, 0.3);
}

TEST(Projection, MirroredObjectsAndCopiesReadTheirOwnPlaces) {
  const std::vector<Mat4x3> places = {placed({0, 0, 0}), placed({0.4f, 3, 0}, {-1, 1, 2}),
                                      placed({-5, 0, 7}, {0.5f, 0.5f, 0.5f})};
  const Baked b = baked(crate(Vec3(1, 0.7f, 0.4f), 0.05f, 3), places);
  for (uint32_t i = 0; i < 3; ++i) {
    const Display d = display_of(crate(Vec3(1, 0.7f, 0.4f), 0, 0), places[i], i);
    const Projection p = projected(b, d);
    expect_right_places(b, d, p.charts[0], i, 0.2);
  }
}

// A floor of 4 x 4 m in strips that charts of their own cover, seen as four triangles.
TEST(Projection, TrianglesAcrossChartsAreSplitWithoutCracks) {
  Mesh strips;
  strips.name = "strips";
  for (int s = 0; s < 4; ++s) {
    const auto first = static_cast<uint32_t>(strips.positions.size());
    const auto x = static_cast<float>(s);
    for (const Vec3& p : {Vec3(x, 0, 0), Vec3(x, 0, 4), Vec3(x + 1, 0, 4), Vec3(x + 1, 0, 0)}) {
      strips.positions.push_back(p);
      strips.normals.push_back({0, 1, 0});
      strips.uv[1].push_back({0.25f * (p.x - x) * 0.9f + 0.25f * static_cast<float>((s * 3) % 4), p.z / 4});
    }
    strips.triangles.push_back({first, first + 1, first + 2});
    strips.triangles.push_back({first, first + 2, first + 3});
  }
  for (uint32_t t = 0; t < strips.triangles.size(); ++t) strips.source_triangle.push_back(t);
  const Baked b = baked(strips);
  ASSERT_EQ(b.atlas.placements.size(), 4u);
  Mesh plain;
  plain.name = "plain";
  plain.positions = {{0, 0, 0}, {0, 0, 4}, {4, 0, 4}, {4, 0, 0}, {1.37f, 0, 2.6f}};
  plain.normals.assign(5, Vec3(0, 1, 0));
  plain.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  plain.source_triangle = {0, 1, 2, 3};
  const Display d = display_of(plain, Mat4x3(1.0f));
  const Projection p = projected(b, d);
  EXPECT_GT(p.fits[0].faces, 8u);
  EXPECT_LT(p.fits[0].shift_texels, 2.5);  // parts of a texel's length at the borders
  expect_right_places(b, d, p.charts[0], 0, 2.5 / 16);
  // Every edge has two faces, or one on the border.
  using Place = std::array<double, 3>;
  std::map<std::pair<Place, Place>, int> sides;
  double area = 0;
  for (size_t f = 0; f < p.charts[0].charts.face_count(); ++f) {
    DVec3 c[3];
    for (int k = 0; k < 3; ++k) c[k] = display_point(d, p.charts[0], f, k == 1, k == 2).at;
    area += 0.5 * length(cross(c[1] - c[0], c[2] - c[0]));
    for (int k = 0; k < 3; ++k) {
      const DVec3 &u = c[k], &v = c[(k + 1) % 3];
      ++sides[std::minmax(Place{u.x, u.y, u.z}, Place{v.x, v.y, v.z})];
    }
  }
  EXPECT_NEAR(area, 16, 1e-5);
  for (const auto& [side, count] : sides) {
    bool border = false;
    for (const int axis : {0, 2})
      for (const double edge : {0.0, 4.0}) border |= side.first[axis] == edge && side.second[axis] == edge;
    EXPECT_EQ(count, border ? 1 : 2) << side.first[0] << " " << side.first[2];
  }
  // Not allowed to split, it is refused rather than wrong.
  LodSettings whole;
  whole.split = 0;
  expect_says(refused(b, d, whole), "(--lod-split would split it)");
}

TEST(Projection, ThreadsChangeNothing) {
  const Baked b = baked(crate_level(0));
  Display d = display_of(crate_level(1), Mat4x3(1.0f));
  for (int i = 0; i < 5; ++i) d.shown.push_back(d.shown[0]);
  LodSettings one, two;
  one.threads = 1, two.threads = 2;
  const Projection p = projected(b, d, one), q = projected(b, d, two);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(p.charts[i].charts.corner_uv, q.charts[i].charts.corner_uv);
    EXPECT_EQ(p.charts[i].placement, q.charts[i].placement);
    EXPECT_EQ(p.fits[i].worst, q.fits[i].worst);
  }
}

}  // namespace
}  // namespace kiln

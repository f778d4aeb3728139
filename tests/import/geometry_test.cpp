#include "coordinator/scene/import/geometry.h"

#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {

TEST(Geometry, StripsAndFansKeepTheWinding) {
  // A flat strip 0-1-2-3-4 zigzagging along x: every triangle must face +z.
  const std::vector<Vec3> strip{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}};
  const Triangles from_strip = triangulate({0, 1, 2, 3, 4}, 5);
  ASSERT_EQ(from_strip.vertices.size(), 3u);
  const std::vector<Vec3> fan{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const Triangles from_fan = triangulate({0, 1, 2, 3}, 6);
  ASSERT_EQ(from_fan.vertices.size(), 2u);
  const auto faces_up = [](const std::vector<Vec3>& p, const UVec3& t) {
    return cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z > 0;
  };
  for (const UVec3& t : from_strip.vertices) EXPECT_TRUE(faces_up(strip, t));
  for (const UVec3& t : from_fan.vertices) EXPECT_TRUE(faces_up(fan, t));
  EXPECT_EQ(triangulate({0, 1, 2, 3, 4}, 4).vertices.size(), 1u) << "an unfinished triangle is dropped";
  EXPECT_TRUE(triangulate({0, 1}, 5).vertices.empty());
  EXPECT_TRUE(triangulate({}, 6).vertices.empty());
}

TEST(Geometry, FlatTrianglesGoTheOthersKeepTheirNumber) {
  const std::vector<Vec3> p{{0, 0, 0},    {1, 0, 0},    {2, 0, 0},      {0, 1, 0},
                            {1000, 0, 0}, {1001, 0, 0}, {1000.5f, 0, 0}};
  Triangles t = triangulate({0, 1, 2, 0, 1, 3, 0, 0, 3, 0, 2, 3, 4, 5, 6}, 4);
  EXPECT_EQ(remove_flat_triangles(p, t), 3u);
  EXPECT_EQ(t.source, (std::vector<uint32_t>{1, 3}));
  EXPECT_EQ(t.vertices[1], UVec3(0, 2, 3));
}

// Small is not flat: the test is relative to where the triangle is.
TEST(Geometry, SmallTrianglesStay) {
  const auto kept = [](float size, float at) {
    const std::vector<Vec3> p{{at, 0, 0}, {at + size, 0, 0}, {at, size, 0}};
    Triangles t = triangulate({0, 1, 2}, 4);
    return remove_flat_triangles(p, t) == 0;
  };
  EXPECT_TRUE(kept(1e-12f, 0));
  EXPECT_TRUE(kept(1e-30f, 0));
  EXPECT_TRUE(kept(1e-3f, 1000));
  EXPECT_FALSE(kept(0, 0));
}

TEST(Geometry, FlatNormalsSplitVertices) {
  Mesh mesh;  // a tent: two triangles sharing the ridge 0-1
  mesh.positions = {{0, 1, 0}, {0, 1, 1}, {1, 0, 0}, {-1, 0, 0}};
  mesh.uv[1] = {{0, 0}, {0, 1}, {1, 0}, {0.5f, 0}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  make_flat_normals(mesh);
  ASSERT_EQ(mesh.positions.size(), 6u);
  ASSERT_EQ(mesh.normals.size(), 6u);
  EXPECT_EQ(mesh.uv[1][2], Vec2(1, 0));
  const float d = std::sqrt(0.5f);
  for (int v = 0; v < 3; ++v) {
    EXPECT_NEAR(length(mesh.normals[v] - Vec3(d, d, 0)), 0, 1e-6f);
    EXPECT_NEAR(length(mesh.normals[3 + v] - Vec3(-d, d, 0)), 0, 1e-6f);
  }
}

TEST(Geometry, NormalsWithoutDirectionAreReplaced) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.normals = {{0, 0, 0}, {0, 0, 20}, {std::nanf(""), 0, 0}};
  EXPECT_EQ(repair_normals(mesh), 2u);
  for (const Vec3& n : mesh.normals) EXPECT_EQ(n, Vec3(0, 0, 1));
}

TEST(Geometry, UnusedVerticesGo) {
  Mesh mesh;
  mesh.positions = {{9, 9, 9}, {0, 0, 0}, {8, 8, 8}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(5, Vec3(0, 0, 1));
  mesh.uv[0] = {{9, 9}, {1, 1}, {8, 8}, {3, 3}, {4, 4}};
  mesh.triangles = {{4, 1, 3}};
  drop_unused_vertices(mesh);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.uv[0], (std::vector<Vec2>{{1, 1}, {3, 3}, {4, 4}}));
  EXPECT_EQ(mesh.triangles[0], UVec3(2, 0, 1));
  EXPECT_EQ(mesh.normals.size(), 3u);
}

// Of equal corners in any rotation the first stays; the opposite winding is another surface. Equal positions
// under different indices, and zeros of both signs, are equal.
TEST(Geometry, RepeatedTrianglesGoOppositeOnesStay) {
  const std::vector<Vec3> p{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-0.0f, 0, 0}, {1, 0, 0}};
  Triangles t = triangulate({0, 1, 3, 0, 1, 2, 1, 2, 0, 0, 2, 1, 2, 4, 5, 5, 4, 2, 0, 1, 3}, 4);
  EXPECT_EQ(remove_repeated_triangles(p, t), 4u);
  EXPECT_EQ(t.source, (std::vector<uint32_t>{0, 1, 3}));
  Triangles all_equal;
  all_equal.vertices.assign(100000, UVec3(0, 1, 2));
  all_equal.source.resize(100000);
  EXPECT_EQ(remove_repeated_triangles(p, all_equal), 99999u);
}

// An edge of 1 m and a height of 1 um, at the origin and a kilometre away: there the height is below half a
// unit in the last place of the coordinates and the side it faces is noise.
TEST(Geometry, SliversStayWhereTheirSideIsKnown) {
  const auto removed = [](float at) {
    const std::vector<Vec3> p{{at, at, 0}, {at + 1, at, 0}, {at + 0.5f, at + 1e-6f, 0}};
    Triangles t = triangulate({0, 1, 2}, 4);
    return remove_flat_triangles(p, t);
  };
  EXPECT_EQ(removed(0), 0u);
  EXPECT_EQ(removed(1000), 1u);
}

}  // namespace
}  // namespace kiln

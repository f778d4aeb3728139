#include "tests/lods/crate.h"

#include "tests/analytic/scene_maker.h"

namespace kiln::test {
namespace {

Vec3 axis_vector(int axis, float value) {
  Vec3 v(0.0f);
  v[axis] = value;
  return v;
}

// Where grid lines cross an edge of `size`: over the flat part, and evenly over the rounded ones.
std::vector<float> lines(float size, float bevel, int segments) {
  const float outer = 0.5f * size, inner = outer - bevel;
  if (segments == 0) return {-outer, outer};
  std::vector<float> at;
  for (int k = 0; k <= segments; ++k)
    at.push_back(-outer + bevel * static_cast<float>(k) / static_cast<float>(segments));
  for (int k = 0; k <= segments; ++k)
    at.push_back(inner + bevel * static_cast<float>(k) / static_cast<float>(segments));
  return at;
}

}  // namespace

Mesh crate(const Vec3& size, float bevel, int segments) {
  Mesh m;
  m.name = "crate of " + std::to_string(segments);
  const Vec3 inner = 0.5f * size - Vec3(bevel);
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const std::vector<float> us = lines(size[u], bevel, segments), vs = lines(size[v], bevel, segments);
      const auto first = static_cast<uint32_t>(m.positions.size());
      const auto columns = static_cast<uint32_t>(us.size()), rows = static_cast<uint32_t>(vs.size());
      for (const float y : vs)
        for (const float x : us) {
          Vec3 p = axis_vector(axis, sign * 0.5f * size[axis]) + axis_vector(u, x) + axis_vector(v, y);
          Vec3 n = axis_vector(axis, sign);
          if (segments > 0) {
            const Vec3 core = glm::clamp(p, -inner, inner);
            n = normalize_or(p - core, n);
            p = core + bevel * n;
          }
          m.positions.push_back(p);
          m.normals.push_back(n);
        }
      for (uint32_t r = 0; r + 1 < rows; ++r)
        for (uint32_t c = 0; c + 1 < columns; ++c) {
          const uint32_t i = first + r * columns + c;
          const UVec3 a(i, i + 1, i + columns + 1), b(i, i + columns + 1, i + columns);
          for (const UVec3& t : {a, b}) m.triangles.push_back(sign > 0 ? t : UVec3(t.x, t.z, t.y));
        }
    }
  for (uint32_t t = 0; t < m.triangles.size(); ++t) m.source_triangle.push_back(t);
  return m;
}

Mesh crate_level(int level) {
  const int segments[] = {4, 1, 0};
  return crate(Vec3(kCrateSize), kCrateBevel, segments[level]);
}

Scene crate_scene(int level) {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.6f));
  const uint32_t lamp = maker.lambert(Vec3(0.0f), Vec3(6.0f));
  maker.environment(Vec3(0.4f));
  maker.quad({-3, -1, -3}, {0, 0, 6}, {6, 0, 0}, grey);
  maker.quad({-1.5f, -1, -3}, {0, 3, 0}, {0, 0, 6}, grey);
  maker.quad({0.5f, 2.5f, 0.2f}, {1.2f, 0, 0}, {0, 0, 1.2f}, lamp);
  Scene scene = maker.take();
  scene.meshes.insert(scene.meshes.begin(), crate_level(level));
  for (Instance& i : scene.instances) ++i.mesh;
  Instance crate;
  crate.material = grey;
  crate.name = "crate";
  scene.instances.insert(scene.instances.begin(), crate);
  return scene;
}

AtlasSettings crate_atlas(const Scene& scene, float texels_per_metre) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = texels_per_metre;
  settings.density.assign(scene.instances.size(), 0.02f);
  settings.density[0] = 1;
  return settings;
}

Display display_of(const Mesh& mesh, const Mat4x3& to_world, uint32_t source) {
  Display d;
  d.meshes = {mesh};
  d.sets.push_back({0, "node 0 'crate'", {source}, "level 0", 0});
  DisplayMesh shown;
  shown.place.to_world = to_world;
  shown.place.name = "crate_low";
  shown.place.node = 1;
  shown.level = 1;
  d.shown.push_back(shown);
  return d;
}

AtlasPlace projected_place(const Atlas& atlas, const ProjectedCharts& projected, size_t face, double b1,
                           double b2) {
  AtlasPlace place;
  place.placement = projected.placement[projected.charts.chart_of_face[face]];
  place.page = atlas.placements[place.placement].page;
  const Triangle2 t = uv_triangle(projected.charts, face);
  place.texels = t.c[0] + b1 * (t.c[1] - t.c[0]) + b2 * (t.c[2] - t.c[0]);
  return place;
}

DisplayPoint display_point(const Display& display, const ProjectedCharts& projected, size_t face, double b1,
                           double b2) {
  const DisplayMesh& shown = display.shown[0];
  const FacePart& part = projected.charts.parts[face];
  const DVec2 a(part.corner[0]), b(part.corner[1]), c(part.corner[2]);
  return DisplaySurface(display.meshes[shown.place.mesh], shown.place.to_world)
      .point(part.triangle, a + b1 * (b - a) + b2 * (c - a));
}

}  // namespace kiln::test

#include "tests/import/gltf_builder.h"
#include "tests/numerics/cases.h"

namespace kiln::test {
namespace {

// Strips of a millionth of a metre across the middle of a 1 m square on y = 0, between two wide ones.
Mesh slivers() {
  constexpr int kStrips = 100;
  std::vector<double> x = {0};
  for (int i = 0; i <= kStrips; ++i) x.push_back(0.5 + (i - kStrips / 2) * 1e-6);
  x.push_back(1);
  Mesh m;
  m.name = "slivers";
  for (const double at : x)
    for (const float z : {0.0f, 1.0f}) {
      m.positions.push_back({static_cast<float>(at), 0, z});
      m.normals.push_back({0, 1, 0});
      m.uv[1].push_back({z, static_cast<float>(at)});
    }
  for (uint32_t i = 0; i + 1 < x.size(); ++i) {
    m.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    m.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  for (uint32_t t = 0; t < m.triangles.size(); ++t) m.source_triangle.push_back(t);
  return m;
}

Measured sliver_furnace() {
  SceneMaker m;
  m.lambert(Vec3(0.5f), Vec3(1.0f));
  m.box({0, 0, 0}, {1, 1, 1}, true);
  m.scene().meshes[0] = slivers();
  return against(mean_e(bake(m.take(), 8, 256)), 2 * M_PI);
}

Measured flat_triangles() {
  constexpr uint32_t kFlat = 2'000'000;
  GltfBuilder b;
  json p;
  p["attributes"]["POSITION"] = b.vec3({0, 0, 0, 0, 0, 2, 2, 0, 2, 2, 0, 0});
  std::vector<uint8_t> indices(3 * kFlat, 0);
  for (size_t i = 0; i < indices.size(); i += 3) indices[i + 1] = static_cast<uint8_t>(i % 4);
  indices.insert(indices.end(), {0, 1, 2, 0, 2, 3});
  p["indices"] = b.accessor_of(indices, 5121, "SCALAR", 1);
  b.node({{"mesh", b.mesh(p)}});
  Scene scene = imported(b).scene;
  EXPECT_EQ(scene.triangle_count(), 2u);
  scene.lights.push_back({"environment", "sky", Mat4x3(1.0f), {{"radiance", {1, 1, 1}, "", {}}}});
  return against(mean_e(bake(std::move(scene), 4, 256)), M_PI);
}

Measured opposite_faces() {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0}).quad({0, 0, 0}, {2, 0, 0}, {0, 0, 2});
  return against(mean_e(bake(m.environment(Vec3(1.0f)).take(), 4, 256)), M_PI);
}

Measured normals(const Vec3& n) {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0}).environment(Vec3(1.0f));
  m.scene().meshes[0].normals.assign(4, n);
  return against(mean_e(bake(m.take(), 4, 256)), M_PI);
}

// A wall that shines, a black wall with a slit of 2 mm in the middle, and the wall behind. A point there sees
// the shining wall through its part of the slit.
Measured slit() {
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true), lamp = m.lambert(Vec3(0.0f), Vec3(1.0f));
  m.quad({2, 0, 0}, {0, 0, 2}, {0, 2, 0}, black);
  m.quad({0, 0, 0}, {0, 2, 0}, {0, 0, 2}, lamp);
  m.quad({1, 0, 0}, {0, 2, 0}, {0, 0, 0.999f}, black);
  m.quad({1, 0, 1.001f}, {0, 2, 0}, {0, 0, 0.999f}, black);
  return ratio_to(bake(m.take(), 4, 32768, {}, 0), 0, [](const Vec3& p, const Vec3& n) {
    const float low = p.y / 2, high = 1 + p.y / 2;
    return polygon_irradiance(p, n,
                              {{1, low, 0.999f}, {1, high, 0.999f}, {1, high, 1.001f}, {1, low, 1.001f}});
  });
}

// A closed hall of 10 m cut by a wall of 1 mm, a lamp on one side.
Measured leak() {
  SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.7f)), lamp = m.lambert(Vec3(0.0f), Vec3(100.0f));
  m.box({0, 0, 0}, {10, 3, 10}, true, wall);
  m.box({4.9995f, 0, 0}, {5.0005f, 3, 10}, false, wall);
  m.quad({1, 2.9f, 4}, {2, 0, 0}, {0, 0, 2}, lamp);
  const Bake b = bake(m.take(), 2, 128);
  double lit = 0, dark = 0, lit_area = 0, dark_area = 0;
  for (const BakedTexel& t : b.texels) {
    // A texel that the wall crosses is rightly lit from the one side.
    const bool is_dark = t.position.x > (std::abs(t.ns.x) > 0.5f ? 5.0f : 5.5f);
    const bool is_lit = t.position.x < (std::abs(t.ns.x) > 0.5f ? 5.0f : 4.5f);
    if (t.inside) continue;
    if (is_lit) lit += t.coverage * t.luminance, lit_area += t.coverage;
    if (is_dark) dark += t.coverage * t.luminance, dark_area += t.coverage;
  }
  return {0, dark / dark_area / (lit / lit_area), 1e-4};
}

// A closed ball of 16,384 triangles under a sky, seen from inside: what comes in comes through edges.
Measured closed_ball(bool watertight) {
  TransportSettings settings;
  settings.watertight = watertight;
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.sphere({0, 0, 0}, 1, 64, 0, true);
  const MeanE e = mean_e(bake(m.environment(Vec3(1.0f)).take(), 8, 1024, settings));
  return {0, e.value / M_PI, watertight ? 0 : 1e-5};
}

}  // namespace

void add_geometry_cases(std::vector<Case>& cases) {
  cases.push_back(
      {"slivers of 1 m by 1 micrometre",
       "E of a closed room of albedo 0.5 that shines, 200 slivers in its floor; four standard errors",
       sliver_furnace});
  cases.push_back({"two million triangles without area",
                   "import leaves two triangles; their E under a sky of 1", flat_triangles});
  cases.push_back(
      {"opposite faces on one place", "E of both under a sky of 1; four standard errors", opposite_faces});
  const std::pair<const char*, Vec3> kinds[] = {{"turned round", {0, -1, 0}},
                                                {"zero", {0, 0, 0}},
                                                {"1e-20 long", {0, 1e-20f, 0}},
                                                {"1e20 long", {0, 1e20f, 0}}};
  for (const auto& [name, n] : kinds)
    cases.push_back({std::string("normals ") + name, "E under a sky of 1; four standard errors",
                     [n = n] { return normals(n); }});
  cases.push_back({"a slit of a thousandth of the room",
                   "E behind it over Lambert's polygon formula of the part that shines; four standard errors",
                   slit});
  cases.push_back({"a closed ball of 16,384 triangles", "E inside over that of the sky outside; goal 1e-5",
                   [] { return closed_ball(false); }});
  cases.push_back({"the same, --watertight on", "E inside over that of the sky outside",
                   [] { return closed_ball(true); }});
  cases.push_back(
      {"a wall of 10 m, 1 mm thick", "E on its dark side over E on the lit side; goal 1e-4", leak});
}

}  // namespace kiln::test

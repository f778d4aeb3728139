#include "tests/atlas/shapes.h"

namespace kiln::test {
namespace {

void add_quad(Mesh& m, const Vec3& o, const Vec3& u, const Vec3& v, const Vec2& lo, const Vec2& hi, Uv uv) {
  const auto first = static_cast<uint32_t>(m.positions.size());
  for (int k = 0; k < 4; ++k) {
    const float a = k == 1 || k == 2 ? 1.0f : 0.0f, b = k >= 2 ? 1.0f : 0.0f;
    m.positions.push_back(o + a * u + b * v);
    m.normals.push_back(normalize_or(cross(u, v), Vec3(0, 1, 0)));
    if (uv == Uv::kUnit) m.uv[1].push_back(lo + Vec2(a, b) * (hi - lo));
  }
  m.triangles.push_back({first, first + 1, first + 2});
  m.triangles.push_back({first, first + 2, first + 3});
}

}  // namespace

Mesh plane(uint32_t n, float size, Uv uv) {
  Mesh m;
  m.name = "plane";
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) {
      const Vec2 q(static_cast<float>(x) / static_cast<float>(n),
                   static_cast<float>(y) / static_cast<float>(n));
      m.positions.push_back({q.x * size, 0, q.y * size});
      m.normals.push_back({0, 1, 0});
      if (uv == Uv::kUnit) m.uv[1].push_back(q);
    }
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t i = y * (n + 1) + x;
      m.triangles.push_back({i, i + n + 1, i + 1});
      m.triangles.push_back({i + 1, i + n + 1, i + n + 2});
    }
  return m;
}

Mesh unshared(const Mesh& mesh) {
  Mesh m;
  m.name = mesh.name;
  for (const UVec3& t : mesh.triangles) {
    const auto first = static_cast<uint32_t>(m.positions.size());
    for (int k = 0; k < 3; ++k) {
      m.positions.push_back(mesh.positions[t[k]]);
      m.normals.push_back(mesh.normals[t[k]]);
      if (!mesh.uv[1].empty()) m.uv[1].push_back(mesh.uv[1][t[k]]);
    }
    m.triangles.push_back({first, first + 1, first + 2});
  }
  return m;
}

Mesh box(const Vec3& size, Uv uv) {
  Mesh m;
  m.name = "box";
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    Vec3 o(0.0f), u(0.0f), v(0.0f);
    u[(axis + 1) % 3] = size[(axis + 1) % 3];
    v[(axis + 2) % 3] = size[(axis + 2) % 3];
    if (face % 2)
      o[axis] = size[axis];
    else
      std::swap(u, v);
    const Vec2 lo(static_cast<float>(face % 3) / 3 + 0.02f, static_cast<float>(face / 3) / 2 + 0.02f);
    add_quad(m, o, u, v, lo, lo + Vec2(0.28f, 0.44f), uv);
  }
  return m;
}

Mesh sphere(uint32_t n, float radius) {
  Mesh m;
  m.name = "sphere";
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= 2 * n; ++x) {
      const double theta = 3.14159265358979 * y / n, phi = 3.14159265358979 * (x % (2 * n)) / n;
      const double ring = y == 0 || y == n ? 0.0 : std::sin(theta);
      m.normals.push_back(Vec3(DVec3(ring * std::cos(phi), std::cos(theta), ring * std::sin(phi))));
      m.positions.push_back(radius * m.normals.back());
    }
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < 2 * n; ++x) {
      const uint32_t i = y * (2 * n + 1) + x, j = i + 2 * n + 1;
      if (y > 0) m.triangles.push_back({i, i + 1, j + 1});
      if (y + 1 < n) m.triangles.push_back({i, j + 1, j});
    }
  return m;
}

Mesh spiral(uint32_t turns, uint32_t steps) {
  Mesh m;
  m.name = "spiral";
  for (uint32_t s = 0; s <= turns * steps; ++s) {
    const double phi = 6.28318530717959 * s / steps;
    for (double r : {1.0, 2.0}) {
      m.positions.push_back(Vec3(DVec3(r * std::cos(phi), 0.3 * s / steps, r * std::sin(phi))));
      m.normals.push_back({0, 1, 0});
    }
  }
  for (uint32_t s = 0; s < turns * steps; ++s) {
    m.triangles.push_back({2 * s, 2 * s + 2, 2 * s + 1});
    m.triangles.push_back({2 * s + 1, 2 * s + 2, 2 * s + 3});
  }
  return m;
}

Mesh soup(uint32_t count, uint64_t seed) {
  Mesh m;
  m.name = "soup";
  Random random(seed);
  const auto number = [&] { return static_cast<float>(random.next() * 4); };
  for (uint32_t t = 0; t < count; ++t) {
    const Vec3 centre(number(), number(), number());
    for (int k = 0; k < 3; ++k) {
      m.positions.push_back(centre + 0.3f * Vec3(number(), number(), number()));
      m.normals.push_back({0, 1, 0});
    }
    m.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return m;
}

Mat4x3 at(const Vec3& origin) {
  Mat4x3 m(1.0f);
  m[3] = origin;
  return m;
}

Instance instance(uint32_t mesh, const std::string& name, const Mat4x3& to_world) {
  Instance i;
  i.mesh = mesh;
  i.name = name;
  i.to_world = to_world;
  return i;
}

Scene scene_of(std::vector<Mesh> meshes) {
  Scene scene;
  scene.meshes = std::move(meshes);
  scene.materials = {{"metallic_roughness", "", Mat4x3(1.0f), {}}};
  for (uint32_t m = 0; m < scene.meshes.size(); ++m)
    scene.instances.push_back(instance(m, scene.meshes[m].name + " " + std::to_string(m),
                                       at({10.0f * static_cast<float>(m), 0, 0})));
  return scene;
}

AtlasSettings pack_at(float texels_per_metre) {
  AtlasSettings s;
  s.layout = AtlasSettings::Layout::kPack;
  s.texels_per_metre = texels_per_metre;
  s.cut_contacts = false;  // charts as the meshes have them
  return s;
}

AtlasSettings file_atlas(uint32_t size) {
  AtlasSettings s;
  s.layout = AtlasSettings::Layout::kAtlas;
  s.width = s.height = size;
  s.cut_contacts = false;
  return s;
}

}  // namespace kiln::test

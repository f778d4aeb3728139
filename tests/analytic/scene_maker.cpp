#include "tests/analytic/scene_maker.h"

#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "common/math/frame.h"

namespace kiln::test {
namespace {

Property numbers(std::string name, std::vector<double> values) {
  return {std::move(name), std::move(values), "", {}};
}
Property rgb(std::string name, const Vec3& v) {
  return numbers(std::move(name), {v.x, v.y, v.z});
}

Mat4x3 along(const Vec3& position, const Vec3& z) {  // third axis along z
  const Frame f(normalize_or(z, Vec3(0, 0, 1)));
  return Mat4x3(f.x, f.y, f.n, position);
}

}  // namespace

SceneMaker& SceneMaker::add(Mesh mesh, uint32_t material) {
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) mesh.source_triangle.push_back(t);
  mesh.name = "mesh" + std::to_string(scene_.meshes.size());
  scene_.instances.push_back(
      {static_cast<uint32_t>(scene_.meshes.size()), material, Mat4x3(1.0f), mesh.name, 0, 0, 0});
  scene_.meshes.push_back(std::move(mesh));
  return *this;
}

SceneMaker& SceneMaker::quad(const Vec3& o, const Vec3& u, const Vec3& v, uint32_t material) {
  Mesh m;
  m.positions = {o, o + u, o + u + v, o + v};
  m.normals.assign(4, normalize_or(cross(u, v), Vec3(0, 1, 0)));
  m.uv[1] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  return add(std::move(m), material);
}

SceneMaker& SceneMaker::sphere(const Vec3& centre, float radius, int n, uint32_t material, bool inwards) {
  Mesh m;
  const int columns = 2 * n;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= columns; ++x) {
      const double theta = M_PI * y / n, phi = 2 * M_PI * x / columns;
      const Vec3 d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
      m.positions.push_back(centre + d * radius);
      m.normals.push_back(inwards ? -d : d);
      m.uv[1].push_back({static_cast<float>(x) / columns, static_cast<float>(y) / n});
    }
  const auto at = [&](int x, int y) { return static_cast<uint32_t>(y * (columns + 1) + x); };
  const auto face = [&](uint32_t a, uint32_t b, uint32_t c) {
    m.triangles.push_back(inwards ? UVec3(a, c, b) : UVec3(a, b, c));
  };
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < columns; ++x) {
      if (y > 0) face(at(x, y), at(x + 1, y), at(x + 1, y + 1));
      if (y < n - 1) face(at(x, y), at(x + 1, y + 1), at(x, y + 1));
    }
  return add(std::move(m), material);
}

SceneMaker& SceneMaker::box(const Vec3& low, const Vec3& high, bool inwards, uint32_t material) {
  const Vec3 d = high - low;
  const Vec3 x(d.x, 0, 0), y(0, d.y, 0), z(0, 0, d.z);
  const auto side = [&](const Vec3& o, const Vec3& u, const Vec3& v) {
    inwards ? quad(o, u, v, material) : quad(o, v, u, material);
  };
  side(low, z, x);      // floor: +y inside
  side(low + y, x, z);  // ceiling
  side(low, x, y);      // z low: +z inside
  side(low + z, y, x);  // z high
  side(low, y, z);      // x low: +x inside
  side(low + x, z, y);  // x high
  return *this;
}

uint32_t SceneMaker::lambert(const Vec3& albedo, const Vec3& emission, bool double_sided) {
  scene_.materials.push_back({"metallic_roughness",
                              "lambert",
                              Mat4x3(1.0f),
                              {numbers("base_color", {albedo.x, albedo.y, albedo.z, 1}),
                               numbers("metallic", {0}), numbers("specular", {0}), rgb("emission", emission),
                               numbers("double_sided", {double_sided ? 1.0 : 0.0})}});
  return static_cast<uint32_t>(scene_.materials.size() - 1);
}

uint32_t SceneMaker::metallic_roughness(const Vec3& color, float metallic, float roughness) {
  scene_.materials.push_back({"metallic_roughness",
                              "glossy",
                              Mat4x3(1.0f),
                              {numbers("base_color", {color.x, color.y, color.z, 1}),
                               numbers("metallic", {metallic}), numbers("roughness", {roughness})}});
  return static_cast<uint32_t>(scene_.materials.size() - 1);
}

SceneMaker& SceneMaker::environment(const Vec3& radiance) {
  scene_.lights.push_back({"environment", "sky", Mat4x3(1.0f), {rgb("radiance", radiance)}});
  return *this;
}

SceneMaker& SceneMaker::add_environment(uint32_t width, uint32_t height, const std::vector<float>& texels,
                                        float scale) {
  Texture t;
  t.name = "sky";
  t.width = width, t.height = height, t.channels = 3, t.format = TexelFormat::kFloat32;
  t.texels.resize(texels.size() * 4);
  std::memcpy(t.texels.data(), texels.data(), t.texels.size());
  Property image{"image", {}, "", {}};
  image.texture.texture = static_cast<int32_t>(scene_.textures.size());
  scene_.textures.push_back(std::move(t));
  scene_.lights.push_back({"environment", "sky", Mat4x3(1.0f), {image, rgb("radiance", Vec3(scale))}});
  return *this;
}

SceneMaker& SceneMaker::sun(const Vec3& to_light, const Vec3& irradiance, float degrees) {
  scene_.lights.push_back(
      {"directional",
       "sun",
       along(Vec3(0.0f), to_light),
       {rgb("color", irradiance), numbers("intensity", {1}), numbers("angle", {degrees})}});
  return *this;
}

SceneMaker& SceneMaker::point(const Vec3& position, const Vec3& intensity, float range) {
  Record r{
      "point", "lamp", along(position, Vec3(0, 0, 1)), {rgb("color", intensity), numbers("intensity", {1})}};
  if (range > 0) r.properties.push_back(numbers("range", {range}));
  scene_.lights.push_back(r);
  return *this;
}

SceneMaker& SceneMaker::spot(const Vec3& position, const Vec3& towards, const Vec3& intensity, float inner,
                             float outer) {
  scene_.lights.push_back({"spot",
                           "spot",
                           along(position, position - towards),
                           {rgb("color", intensity), numbers("intensity", {1}), numbers("inner", {inner}),
                            numbers("outer", {outer})}});
  return *this;
}

SceneMaker& SceneMaker::rectangle(const Vec3& centre, const Vec3& x, const Vec3& y, const Vec2& size,
                                  const Vec3& radiance, int sides) {
  scene_.lights.push_back({"rectangle",
                           "panel",
                           Mat4x3(x, y, cross(x, y), centre),
                           {numbers("size", {size.x, size.y}), rgb("radiance", radiance),
                            numbers("sides", {static_cast<double>(sides)})}});
  return *this;
}

SceneMaker& SceneMaker::disc(const Vec3& centre, const Vec3& shine, float radius, const Vec3& radiance,
                             int sides) {
  scene_.lights.push_back({"disc",
                           "round",
                           along(centre, -shine),
                           {numbers("radius", {radius}), rgb("radiance", radiance),
                            numbers("sides", {static_cast<double>(sides)})}});
  return *this;
}

Vec3 equirect_direction(uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
  const double phi = 2 * M_PI * ((x + 0.5) / width - 0.5), theta = M_PI * (y + 0.5) / height;
  return Vec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
}

}  // namespace kiln::test

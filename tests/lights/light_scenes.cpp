#include "tests/lights/light_scenes.h"

#include <cstring>

#include "common/math/frame.h"
#include "tests/lights/statistics.h"

namespace kiln::test {
namespace {

Property numbers(std::string name, std::vector<double> values) {
  return {std::move(name), std::move(values), "", {}};
}
Property texture_property(std::string name, size_t index) {
  Property p{std::move(name), {}, "", {}};
  p.texture.texture = static_cast<int32_t>(index);
  return p;
}

}  // namespace

LitScene light_up(Scene scene, LightChoice choice) {
  LitScene out;
  auto surfaces = Surfaces::create(std::move(scene), out.warnings);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  out.surfaces = std::move(*surfaces);
  auto lights = Lights::create(*out.surfaces, out.warnings, choice);
  if (!lights) throw std::runtime_error(lights.error().message);
  out.lights = std::move(*lights);
  return out;
}

Texture gray_texture(uint32_t width, uint32_t height, const std::vector<float>& texels) {
  Texture t;
  t.name = "gray";
  t.width = width, t.height = height, t.channels = 1, t.format = TexelFormat::kFloat32;
  t.texels.resize(texels.size() * sizeof(float));
  std::memcpy(t.texels.data(), texels.data(), t.texels.size());
  return t;
}

uint32_t emissive_texture(SceneMaker& maker, Texture texture, bool double_sided) {
  const uint32_t m = maker.lambert(Vec3(0.0f), Vec3(1.0f), double_sided);
  maker.scene().materials[m].properties.push_back(
      texture_property("emission_texture", maker.scene().textures.size()));
  maker.scene().textures.push_back(std::move(texture));
  return m;
}

void textured_quad(SceneMaker& maker, const Vec3& origin, const Vec3& u, const Vec3& v, uint32_t material,
                   float repeats) {
  maker.quad(origin, u, v, material);
  Mesh& mesh = maker.scene().meshes.back();
  mesh.uv[0] = mesh.uv[1];
  for (Vec2& uv : mesh.uv[0]) uv *= repeats;
}

void add_ies(Scene& scene, const Vec3& position, const std::vector<double>& vertical,
             const std::vector<double>& horizontal, const std::vector<float>& candela) {
  Record r{"ies", "profile", Mat4x3(1.0f), {}};
  r.to_world[3] = position;
  r.properties = {numbers("color", {1, 1, 1}), numbers("intensity", {1}), numbers("vertical", vertical),
                  numbers("horizontal", horizontal), texture_property("candela", scene.textures.size())};
  scene.textures.push_back(gray_texture(static_cast<uint32_t>(vertical.size()),
                                        static_cast<uint32_t>(horizontal.size()), candela));
  scene.lights.push_back(std::move(r));
}

Scene mixed_lights(int n, uint64_t seed, const Vec3& low, const Vec3& high) {
  Random random(seed);
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad(low - Vec3(0, 1, 0), {1, 0, 0}, {0, 0, 1});  // dark
  const uint32_t one = m.lambert(Vec3(0.0f), Vec3(3.0f)), two = m.lambert(Vec3(0.0f), Vec3(2.0f), true);
  const uint32_t textured =
      emissive_texture(m, gray_texture(4, 4, {0, 0, 9, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 5, 5}));
  for (int i = 0; i < n; ++i) {
    const auto place = [&] { return random.in_box(low, high); };
    const float strength = std::pow(10.0f, 4 * random.one() - 2);
    m.point(place(), Vec3(strength));
    m.point(place(), Vec3(strength), 2 + 3 * random.one());
    const Vec3 from = place();
    m.spot(from, from + random.direction(), Vec3(strength), 0.3f * random.one(), 0.3f + random.one());
    add_ies(m.scene(), place(), {0, 40, 60}, {0, 90, 360}, {3, 2, 0, 5, 1, 0, 3, 2, 0});
    for (const uint32_t material : {one, two, textured}) {
      const Vec3 u = random.direction() * 0.5f, v = random.direction() * 0.5f;
      textured_quad(m, place(), u, v, material);
    }
    const Frame frame(random.direction());
    const int sides = 1 + i % 2;
    m.rectangle(place(), frame.x, frame.y, {0.1f + random.one(), 0.4f}, Vec3(2.5f), sides);
    m.disc(place(), random.direction(), 0.1f + 0.3f * random.one(), Vec3(2.5f), sides);
  }
  return m.take();
}

}  // namespace kiln::test

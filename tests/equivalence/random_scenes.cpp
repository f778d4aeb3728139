#include "tests/equivalence/random_scenes.h"

#include "common/math/frame.h"
#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"
#include "worker/integrators/integrator.h"

namespace kiln::test {
namespace {

// Roughness stays above 0.35 and emitters stay 0.4 m away from everything: with light sampling or paths
// alone, sharper lobes and closer lights have no variance that a stated error could be made of.
class RandomRoom {
 public:
  explicit RandomRoom(uint32_t seed) : random_(seed) {}

  Scene make() {
    size_ = Vec3(between(5, 6), between(3, 4), between(4, 6));
    for (int i = 0; i < 6; ++i) surfaces_.push_back(reflecting());
    walls();
    const int things = 2 + static_cast<int>(4 * random_.one());
    for (int i = 0; i < things; ++i) thing();
    if (chance(0.4f)) pane(glass());
    if (chance(0.4f)) pane(veil());
    const int emitters = 1 + static_cast<int>(3 * random_.one());
    for (int i = 0; i < emitters; ++i) emitter(0.6f + 1.3f * i);
    environment();
    delta_lights();
    return maker_.take();
  }

 private:
  float between(float low, float high) { return low + (high - low) * random_.one(); }
  bool chance(float p) { return random_.one() < p; }
  Vec3 colour(float low, float high) {
    const float r = between(low, high), g = between(low, high);
    return {r, g, between(low, high)};
  }
  uint32_t any_surface() { return surfaces_[static_cast<size_t>(random_.one() * surfaces_.size())]; }
  std::vector<Property>& properties(uint32_t material) {
    return maker_.scene().materials[material].properties;
  }

  uint32_t reflecting() {
    if (chance(0.5f)) return maker_.lambert(colour(0.1f, 0.8f), Vec3(0.0f), chance(0.3f));
    const Vec3 base = colour(0.2f, 0.9f);
    const float metallic = chance(0.5f) ? 0.0f : between(0, 1);
    const uint32_t m = maker_.metallic_roughness(base, metallic, between(0.35f, 1));
    if (chance(0.3f)) {
      properties(m).push_back({"clearcoat", {between(0, 1)}, "", {}});
      properties(m).push_back({"clearcoat_roughness", {between(0.35f, 1)}, "", {}});
    }
    return m;
  }
  uint32_t glass() {
    const uint32_t m = maker_.metallic_roughness(colour(0.6f, 1), 0, between(0.35f, 1));
    properties(m).push_back({"transmission", {between(0.5f, 1)}, "", {}});
    properties(m).push_back({"double_sided", {1}, "", {}});
    return m;
  }
  uint32_t veil() {  // lets a part through by alpha
    const uint32_t m = maker_.lambert(colour(0.2f, 0.8f), Vec3(0.0f), true);
    for (Property& p : properties(m))
      if (p.name == "base_color") p.numbers[3] = between(0.2f, 0.8f);
    properties(m).push_back({"alpha_mode", {}, "blend", {}});
    return m;
  }

  void walls() {
    const Vec3 x(size_.x, 0, 0), y(0, size_.y, 0), z(0, 0, size_.z);
    const bool roof = chance(0.6f), front = chance(0.7f);
    maker_.quad(Vec3(0.0f), z, x, any_surface());
    if (roof) maker_.quad(y, x, z, any_surface());
    if (front) maker_.quad(Vec3(0.0f), x, y, any_surface());
    maker_.quad(z, y, x, any_surface());
    maker_.quad(Vec3(0.0f), y, z, any_surface());
    maker_.quad(x, z, y, any_surface());
  }

  // A box, a sphere, or a mirrored and a turned copy of what was made before.
  void thing() {
    const Vec3 at = random_.in_box({0.6f, 0.01f, 0.6f}, {size_.x - 1.4f, 0.5f, size_.z - 1.4f});
    if (chance(0.4f)) {
      maker_.box(at, at + random_.in_box(Vec3(0.2f), Vec3(0.8f)), false, any_surface());
    } else {
      maker_.sphere(at + Vec3(0.4f), between(0.2f, 0.4f), 6, any_surface());
    }
    if (!chance(0.4f)) return;
    Instance copy = maker_.scene().instances.back();
    copy.name += " mirrored";
    const float angle = between(-0.3f, 0.3f), s = std::sin(angle), c = std::cos(angle);
    copy.to_world =
        Mat4x3(Vec3(-0.9f * c, 0, 0.9f * s), Vec3(0, 0.8f, 0), Vec3(s, 0, c), Vec3(size_.x, 0, 0));
    maker_.scene().instances.push_back(copy);
  }

  void pane(uint32_t material) {
    const Vec3 at = random_.in_box({0.5f, 0.1f, 0.5f}, {size_.x - 2, 0.4f, size_.z - 2});
    maker_.quad(at, {1.2f, 0, between(-0.5f, 0.5f)}, {0, 1.0f, between(-0.2f, 0.2f)}, material);
  }

  void emitter(float x) {
    const Vec3 at = random_.in_box({x, size_.y - 0.9f, 1}, {x + 0.1f, size_.y - 0.6f, size_.z - 2.4f});
    const Vec3 u(between(0.5f, 0.9f), between(-0.1f, 0.1f), 0),
        v(0, between(-0.1f, 0.1f), between(0.6f, 1.4f));
    const bool double_sided = chance(0.3f);
    if (chance(0.5f)) {
      maker_.quad(at, u, v, maker_.lambert(Vec3(0.3f), colour(4, 12), double_sided));
      return;
    }
    std::vector<float> texels;
    for (int i = 0; i < 16; ++i) texels.push_back(chance(0.4f) ? 0.0f : between(1, 15));
    textured_quad(maker_, at, u, v, emissive_texture(maker_, gray_texture(4, 4, texels), double_sided));
  }

  void environment() {
    const float kind = random_.one();
    if (kind < 0.3f) maker_.environment(colour(0.1f, 1));
    if (kind < 0.5f) return;
    const Vec3 bright = random_.direction(), tint = colour(0.3f, 1);
    maker_.environment_image(16, 8, [&](const Vec3& d) {
      return tint * (0.2f + 0.5f * std::max(0.0f, d.y) + (dot(d, bright) > 0.85f ? 6.0f : 0.0f));
    });
  }

  void delta_lights() {
    const int points = static_cast<int>(3 * random_.one());
    for (int i = 0; i < points; ++i)
      maker_.point(random_.in_box({1, 2, 1}, {size_.x - 1, 2.6f, size_.z - 1}), colour(1, 5),
                   chance(0.5f) ? between(3, 8) : 0.0f);
    if (chance(0.5f)) {
      const Vec3 from = random_.in_box({1, 2, 1}, {size_.x - 1, 2.6f, size_.z - 1});
      maker_.spot(from, from + Vec3(between(-1, 1), -1, between(-1, 1)), colour(2, 8), 0.2f, 0.7f);
    }
    if (chance(0.5f))
      maker_.sun({between(-1, 1), 1, between(-1, 1)}, colour(1, 5), chance(0.5f) ? between(0.5f, 20) : 0.0f);
  }

  Random random_;
  SceneMaker maker_;
  Vec3 size_{0.0f};
  std::vector<uint32_t> surfaces_;
};

}  // namespace

Scene random_scene(uint32_t seed, bool other_lights) {
  Scene scene = RandomRoom(seed).make();
  if (!other_lights) std::erase_if(scene.lights, [](const Record& r) { return r.type != "environment"; });
  return scene;
}

Scene with_area_lights(Scene scene, uint32_t seed, bool alone) {
  Random random(seed + 1000);
  SceneMaker m;
  m.scene() = std::move(scene);
  if (alone)
    for (Record& material : m.scene().materials)
      std::erase_if(material.properties, [](const Property& p) { return p.name.starts_with("emission"); });
  // Within every room of random_scene(), clear of its walls and of most things.
  const auto place = [&] { return random.in_box({1, 1.6f, 1}, {4, 2.2f, 3}); };
  const auto radiance = [&] { return random.in_box(Vec3(3), Vec3(9)); };
  const int sides = 1 + static_cast<int>(2 * random.one());
  const Frame frame(normalize_or(random.direction() + Vec3(0, 2, 0), Vec3(0, 1, 0)));  // shines down
  const Vec3 at = place();
  const float width = 0.5f + random.one();
  m.rectangle(at, frame.x, frame.y, {width, 0.6f}, radiance(), sides);
  const Vec3 hung = place();
  m.disc(hung, normalize_or(random.direction() - Vec3(0, 1, 0), Vec3(0)), 0.3f + 0.3f * random.one(),
         radiance(), 3 - sides);
  return m.take();
}

Scene scene_of(uint32_t features) {
  SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.6f, 0.5f, 0.4f));
  uint32_t thing = wall;
  if (features & kLayers) thing = m.metallic_roughness(Vec3(0.8f, 0.7f, 0.3f), 0.7f, 0.4f);
  m.quad({0, 0, 0}, {0, 0, 3}, {3, 0, 0}, wall);
  m.quad({0, 0, 0}, {3, 0, 0}, {0, 2, 0}, thing);
  m.quad({0, 0, 0}, {0, 2, 0}, {0, 0, 3}, wall);
  m.box({1, 0.01f, 1}, {1.8f, 1, 1.6f}, false, thing);
  if (features & kGlass) {
    const uint32_t glass = m.metallic_roughness(Vec3(0.9f, 0.8f, 0.9f), 0, 0.5f);
    m.scene().materials[glass].properties.push_back({"transmission", {0.9}, "", {}});
    m.scene().materials[glass].properties.push_back({"absorption", {1, 0.5, 0.2}, "", {}});
    m.box({2, 0.2f, 0.4f}, {2.5f, 1.4f, 2.4f}, false, glass);
  }
  if (features & kLocalLights) {
    m.quad({1, 1.9f, 1}, {0.5f, 0, 0}, {0, 0, 0.5f}, m.lambert(Vec3(0.0f), Vec3(9, 7, 5)));
    m.point({0.5f, 1.5f, 2.5f}, Vec3(2.0f));
  }
  if (features & kAreaLights) {
    m.rectangle({1.4f, 1.5f, 2.2f}, {1, 0, 0}, {0, 0, -1}, {0.8f, 0.4f}, Vec3(4, 5, 6));
    m.disc({2.4f, 1.2f, 1}, normalize_or(Vec3(-1, 0.2f, 0.5f), Vec3(0)), 0.3f, Vec3(5, 4, 4), 2);
    m.scene().lights.back().properties.push_back({"bake", {}, "indirect", {}});
  }
  if (features & kSuns) m.sun({0.4f, 1, 0.3f}, Vec3(3, 2.8f, 2.5f), 5);
  if (features & kSkyImage)
    m.environment_image(16, 8, [](const Vec3& d) { return Vec3(0.3f + std::max(0.0f, d.y + d.x), 0.6f, 1); });
  else
    m.environment({0.3f, 0.4f, 0.6f});
  return m.take();
}

}  // namespace kiln::test

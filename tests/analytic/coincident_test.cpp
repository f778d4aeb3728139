// Triangles on exactly the same place: what a ray meets depends on the ray and the scene alone.
#include "worker/surface/coincident.h"

#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

struct Traced {
  std::unique_ptr<Surfaces> surfaces;
  std::unique_ptr<Tracer> plain, ruled;
};
Traced build(Scene scene) {
  Traced t;
  std::vector<std::string> warnings;
  t.surfaces = *Surfaces::create(std::move(scene), warnings);
  t.plain = *Tracer::create(t.surfaces->scene(), *t.surfaces, "sse2", 1);
  t.ruled = with_coincident_rule(*Tracer::create(t.surfaces->scene(), *t.surfaces, "sse2", 1), *t.surfaces);
  return t;
}

// Corners whose differences round.
const Vec3 kCorner(0.137f, 0, 0.211f), kSideZ(0, 0, 0.831f), kSideX(0.717f, 0, 0.003f);

// Rays from both sides through the parallelogram at y = 0.
std::vector<Ray> rays() {
  std::vector<Ray> out;
  for (uint32_t i = 0; i < 2000; ++i) {
    const SampleStream s(1, 0, i);
    const Vec2 u = s.pair(0);
    Vec3 d = cosine_hemisphere(s.pair(1));
    d = Vec3(d.x, i % 2 ? d.z : -d.z, d.y);
    out.push_back({kCorner + kSideX * u.x + kSideZ * u.y - d * 2.0f, d});
  }
  return out;
}

void turn_around(Mesh& mesh) {
  for (UVec3& t : mesh.triangles) std::swap(t.y, t.z);
  for (Vec3& n : mesh.normals) n = -n;
}
// The same triangles with their corners in another rotation.
void rotate_corners(Mesh& mesh) {
  for (UVec3& t : mesh.triangles) t = UVec3(t.y, t.z, t.x);
}

// Quads there; bit k of `turned` turns quad k around.
Scene sheets(int count, int turned, bool rotated = false) {
  test::SceneMaker m;
  for (int k = 0; k < count; ++k) {
    m.lambert(Vec3(0.5f));
    m.quad(kCorner, kSideZ, kSideX, static_cast<uint32_t>(k));
    if (turned >> k & 1) turn_around(m.scene().meshes.back());
    if (rotated && k == count - 1) rotate_corners(m.scene().meshes.back());
  }
  return m.take();
}

TEST(Coincident, TheSideThatFacesTheRayIsMet) {
  for (int turned = 0; turned < 16; ++turned) {
    const Traced t = build(sheets(4, turned));
    size_t backs = 0;
    for (const Ray& ray : rays()) {
      const Hit hit = t.ruled->intersect(ray, 0);
      ASSERT_TRUE(hit.valid());
      const bool from_above = ray.direction.y < 0;
      const uint32_t wanted =
          from_above ? static_cast<uint32_t>(~turned & 15) : static_cast<uint32_t>(turned);
      const uint32_t expected = wanted ? static_cast<uint32_t>(std::countr_zero(wanted)) : 0;
      EXPECT_EQ(hit.instance, expected) << turned;
      const Vec3 met = t.surfaces->at(hit.instance, hit.triangle, hit.b1, hit.b2).position;
      EXPECT_LT(length(met - (ray.origin + ray.direction * 2.0f)), 2e-6f);
      EXPECT_NEAR(hit.t, 2.0f, 1e-6f / std::abs(ray.direction.y));
      backs += t.plain->intersect(ray, 0).instance != expected;
    }
    if (turned == 2) EXPECT_GT(backs, 0u);  // what this is against
  }
}

// Whichever of two triangles the structure returns, and whatever point it found, not a bit of what is met
// changes.
class Returns final : public Tracer {
 public:
  Returns(const Tracer& inner, uint32_t instance) : inner_(inner), instance_(instance) {}
  Hit intersect(const Ray& ray, uint32_t key) const override {
    Hit hit = inner_.intersect(ray, key);
    hit.instance = instance_;
    hit.t *= 1.0f + 1e-6f * static_cast<float>(instance_);
    if (instance_ == 1) hit.b1 = 1.0f - hit.b1 - hit.b2;  // as if corners were counted from another one
    return hit;
  }
  Vec3 transmittance(const Ray& ray) const override { return inner_.transmittance(ray); }
  void transmittance(std::span<const Ray> rays, Vec3* passed) const override {
    inner_.transmittance(rays, passed);
  }
  size_t memory_bytes() const override { return 0; }

 private:
  const Tracer& inner_;
  uint32_t instance_;
};

TEST(Coincident, WhichOfThemIsFoundDoesNotMatter) {
  const Traced t = build(sheets(2, 0, true));
  const auto a = with_coincident_rule(std::make_unique<Returns>(*t.plain, 0), *t.surfaces);
  const auto b = with_coincident_rule(std::make_unique<Returns>(*t.plain, 1), *t.surfaces);
  for (const Ray& ray : rays()) {
    const Hit x = a->intersect(ray, 0), y = b->intersect(ray, 0);
    EXPECT_TRUE(x.instance == 0 && y.instance == 0 && x.triangle == y.triangle);
    EXPECT_TRUE(x.b1 == y.b1 && x.b2 == y.b2 && x.t == y.t);
  }
}

TEST(Coincident, MirroredAndInstancedSheetsToo) {
  Scene scene = sheets(2, 0);
  scene.instances.push_back(scene.instances[0]);  // mesh 0 twice: instanced
  Mat4x3 mirror(1.0f);
  mirror[0] = Vec3(-1, 0, 0);
  mirror[3] = Vec3(2 * kCorner.x + kSideX.x, 0, 0);  // nearly onto itself, diagonals crossed
  scene.instances[2].to_world = mirror;
  const Traced t = build(std::move(scene));
  for (const Ray& ray : rays()) {
    const Hit hit = t.ruled->intersect(ray, 0);
    ASSERT_TRUE(hit.valid());
    EXPECT_NE(hit.instance, 1u);  // it lies on instance 0, which comes first
  }
}

TEST(Coincident, NothingIsAddedWhereNothingCoincides) {
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.box({0, 0, 0}, {1, 1, 1}, false);
  m.quad({0, 2, 0}, {0, 0, 1}, {1, 0, 0});
  std::vector<std::string> warnings;
  const auto surfaces = *Surfaces::create(m.take(), warnings);
  auto tracer = *Tracer::create(surfaces->scene(), *surfaces, "sse2", 1);
  const Tracer* plain = tracer.get();
  EXPECT_EQ(with_coincident_rule(std::move(tracer), *surfaces).get(), plain);
}

// A two-faced sheet lit from below: a floor above it sees its upper, dark side, whatever the order of the
// two.
TEST(Coincident, ATwoFacedSheetHasTwoColours) {
  double up[2];
  for (const bool swapped : {false, true}) {
    test::SceneMaker m;
    const uint32_t black = m.lambert(Vec3(0.0f)), red = m.lambert(Vec3(0.0f), Vec3(1, 0, 0)),
                   blue = m.lambert(Vec3(0.0f), Vec3(0, 0, 1));
    m.quad({-1, 0.5f, -1}, {2, 0, 0}, {0, 0, 2}, black);  // looks down at the sheet
    for (const bool upper : {!swapped, swapped}) {
      m.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, upper ? red : blue);
      if (!upper) turn_around(m.scene().meshes.back());
    }
    const test::Bake b = test::bake(m.take(), 2, 256, {}, 0);
    double red_light = 0;
    for (const test::BakedTexel& t : b.texels) {
      EXPECT_EQ(t.e.z, 0.0f);
      EXPECT_FALSE(t.inside);
      red_light += double{t.e.x} / static_cast<double>(b.texels.size());
    }
    EXPECT_GT(red_light, 2.5);  // nearly pi: the sheet fills most of what the floor sees
    up[swapped] = red_light;
  }
  EXPECT_NEAR(up[0], up[1], 0.03);
}

}  // namespace
}  // namespace kiln

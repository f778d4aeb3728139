// E(n) rebuilt from L1 moments against quadrature of the same reconstruction, for radiances whose L1
// projection over the hemisphere is known.
#include "common/responses/basis.h"
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

struct Projection {
  double l0 = 0;
  DVec3 l1{0.0};
};

// L0 and L1 of radiance over the upper hemisphere (y up), by quadrature.
template <class F>
Projection project(const F& radiance) {
  Projection p;
  const int n = 400;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double y = (i + 0.5) / n, r = std::sqrt(1 - y * y), a = 2 * M_PI * (k + 0.5) / n;
      const DVec3 d(r * std::cos(a), y, r * std::sin(a));
      const double l = radiance(d) * 2 * M_PI / (double(n) * n) / (4 * M_PI);
      p.l0 += l;
      p.l1 += d * l;
    }
  return p;
}

void expect_projection(const test::Bake& b, const Projection& truth) {
  double l0 = 0;
  DVec3 l1(0.0);
  for (const auto& t : b.texels) {
    l0 += t.l0.y;
    for (int k = 0; k < 3; ++k) l1[k] += t.l1[k].y;
  }
  l0 /= static_cast<double>(b.texels.size());
  l1 /= static_cast<double>(b.texels.size());
  EXPECT_NEAR(l0, truth.l0, 0.005 * truth.l0);
  for (const Vec3& n : {Vec3(0, 1, 0), Vec3(0.6f, 0.8f, 0), Vec3(0, 0.8f, -0.6f), Vec3(-0.8f, 0.6f, 0)}) {
    const double measured = sh_l1_irradiance(static_cast<float>(l0), Vec3(l1), n);
    const double expected = M_PI * (truth.l0 + 2 * glm::dot(truth.l1, DVec3(n)));
    EXPECT_NEAR(measured, expected, 0.005 * M_PI * 2 * truth.l0) << n.x << " " << n.y << " " << n.z;
  }
}

test::SceneMaker plane() {
  test::SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  return m;
}

TEST(ShL1, ConstantRadiance) {
  auto m = plane();
  const auto b = test::bake(m.environment(Vec3(1.0f)).take(), 4, 256);
  expect_projection(b, project([](const DVec3&) { return 1.0; }));
  // For the surface's own normal the linear form is exact here: L0 = 1/2, L1 = n/4, E = pi.
  EXPECT_NEAR(sh_l1_irradiance(0.5f, Vec3(0, 0.25f, 0), Vec3(0, 1, 0)), M_PI, 1e-6);
}

TEST(ShL1, LinearRadiance) {
  auto m = plane();
  m.environment_image(256, 128, [](const Vec3& d) { return Vec3(1.0f + 0.8f * d.x + 0.1f * d.z); });
  const auto b = test::bake(m.take(), 4, 512);
  expect_projection(b, project([](const DVec3& d) { return 1 + 0.8 * d.x + 0.1 * d.z; }));
}

TEST(ShL1, DeltaRadiance) {
  auto m = plane();
  const DVec3 to_sun = glm::normalize(DVec3(1, 2, -0.5));
  const auto b = test::bake(m.sun(Vec3(to_sun), Vec3(5.0f)).take(), 4, 64);
  // A delta of facing irradiance 5: L0 = 5/(4 pi), L1 = L0 d.
  expect_projection(b, {5 / (4 * M_PI), to_sun * (5 / (4 * M_PI))});
  for (const auto& t : b.texels) EXPECT_NEAR(t.e.y, 5 * to_sun.y, 1e-4);
}

TEST(ShL1, MomentsAgreeWithE) {
  // E at the surface normal comes from the same samples: for a constant sky both are pi, with one noise.
  auto m = plane();
  const auto b = test::bake(m.environment(Vec3(1.0f)).take(), 4, 64);
  for (const auto& t : b.texels) {
    const double rebuilt = sh_l1_irradiance(t.l0.y, Vec3(t.l1[0].y, t.l1[1].y, t.l1[2].y), Vec3(0, 1, 0));
    EXPECT_NEAR(rebuilt, t.e.y, 6 * t.standard_error);
  }
}

}  // namespace
}  // namespace kiln

// Lights with an area: their density against the solid angle by other formulas, their samples against their
// density, and receivers at every extreme.
#include "common/math/frame.h"
#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"

namespace kiln {
namespace {

using test::Mean;
using test::Random;
using test::SceneMaker;

// A light in the plane z = 0 around the origin that shines along -z, and what it covers.
struct Sheet {
  std::string name;
  DVec2 half;  // of the rectangle, or the radius twice
  bool round;
  int sides;

  test::LitScene lit(const Vec3& at = Vec3(0)) const {
    SceneMaker m;
    m.lambert(Vec3(0.5f));
    m.quad({-1, 9, -1}, {0, 0, 2}, {2, 0, 0});
    const Vec2 size(2.0 * half);
    if (round)
      m.disc(at, Vec3(0, 0, -1), static_cast<float>(half.x), Vec3(3), sides);
    else
      m.rectangle(at, {1, 0, 0}, {0, 1, 0}, size, Vec3(3), sides);
    return test::light_up(m.take());
  }
  // A point of the sheet for s and t in [-1, 1], and its area per ds dt.
  DVec2 point(double s, double t) const {
    if (!round) return {s * half.x, t * half.y};
    const double r = half.x * std::sqrt(0.5 * (1 + s));
    return {r * std::cos(M_PI * t), r * std::sin(M_PI * t)};
  }
  double cell() const { return round ? 0.25 * M_PI * half.x * half.x : half.x * half.y; }
};

std::vector<Sheet> sheets() {
  return {{"square", {0.5, 0.5}, false, 1},
          {"strip", {2, 0.05}, false, 1},
          {"two-sided rectangle", {0.4, 0.7}, false, 2},
          {"disc", {0.6, 0.6}, true, 1},
          {"two-sided disc", {0.3, 0.3}, true, 2}};
}

const Vec3 kReceivers[] = {{0, 0, -1}, {0.3f, -0.2f, -0.6f}, {1.5f, 0.4f, -0.5f}, {-3, 2, -4}, {0.1f, 3, -1}};
// From where rectangles are sampled by area: they subtend less than a millionth.
const Vec3 kFarReceivers[] = {{300, 400, -2000}, {900, -300, -500}};
// Where the weight of samples by area would have no bound.
const Vec3 kCloseReceivers[] = {{0.1f, 0.02f, -0.01f}, {0.45f, 0, -0.05f}, {0.7f, 0.1f, -0.02f}};

TEST(AreaLight, DensityIntegratesToOne) {
  for (const Sheet& sheet : sheets())
    for (const Vec3& below : kReceivers)
      for (const float side : {1.0f, -1.0f}) {
        const Vec3 p = below * Vec3(1, 1, side);
        const test::LitScene scene = sheet.lit();
        constexpr int kSteps = 200;
        double integral = 0;
        for (int j = 0; j < kSteps; ++j)
          for (int i = 0; i < kSteps; ++i) {
            const DVec2 q = sheet.point((2 * i + 1.0) / kSteps - 1, (2 * j + 1.0) / kSteps - 1);
            const DVec3 d = DVec3(q.x, q.y, 0) - DVec3(p);
            const double d2 = glm::dot(d, d), omega = std::abs(d.z) / (d2 * std::sqrt(d2)) * sheet.cell();
            float pdf = 0;
            scene.lights.local.for_each_crossing(p, Vec3(0, 0, side), {p, Vec3(d / std::sqrt(d2)), 0, 1e9},
                                                 [&](const LocalLights::Crossing& c) { pdf += c.pdf; });
            integral += static_cast<double>(pdf) * omega * 4 / (kSteps * kSteps);
          }
        // The midpoint rule: below (step / height)^2 of the integrand's curvature, and at the rim a row of
        // points whose direction in floats passes by.
        const double step = 2.0 * std::max(sheet.half.x, sheet.half.y) / kSteps / std::abs(below.z);
        EXPECT_NEAR(integral, side > 0 || sheet.sides == 2 ? 1 : 0, 4 * step * step + 1e-5) << sheet.name;
      }
}

TEST(AreaLight, NothingBesideIt) {
  Random random(1);
  for (const Sheet& sheet : sheets()) {
    const test::LitScene scene = sheet.lit();
    int met = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p = kReceivers[i % 5], d = random.direction();
      const double t = static_cast<double>(p.z) / -d.z;
      const DVec2 q(p.x + t * d.x, p.y + t * d.y);
      const double out = sheet.round ? glm::length(q) / sheet.half.x
                                     : std::max(std::abs(q.x) / sheet.half.x, std::abs(q.y) / sheet.half.y);
      bool crossed = false;
      scene.lights.local.for_each_crossing(p, Vec3(0, 0, 1), {p, d, 0, 1e9},
                                           [&](const LocalLights::Crossing& c) {
                                             crossed = true;
                                             EXPECT_NEAR(c.distance, t, 1e-4 * t);
                                             EXPECT_GT(c.pdf, 0.0f);
                                             EXPECT_EQ(c.radiance, Vec3(3));
                                           });
      if (std::abs(out - 1) < 1e-5) continue;
      ASSERT_EQ(crossed, d.z > 0 && out < 1) << sheet.name;
      met += crossed;
      if (crossed)
        scene.lights.local.for_each_crossing(
            p, Vec3(0, 0, 1), {p, d, 0, 0.9 * t},
            [](const LocalLights::Crossing&) { ADD_FAILURE() << "too far"; });
    }
    EXPECT_GT(met, 20) << sheet.name;
  }
}

// Samples in 8 x 8 cells of the sheet against the density's share of them, and each sample's own density.
TEST(AreaLight, SamplesFollowTheDensity) {
  for (const Sheet& sheet : sheets())
    for (const Vec3& p : kReceivers) {
      const test::LitScene scene = sheet.lit();
      constexpr int kBins = 8, kSteps = 160, kDraws = 50000;
      const auto bin_of = [&](double s, double t) {
        const auto place = [](double x) {
          return std::clamp(static_cast<int>((x + 1) / 2 * kBins), 0, kBins - 1);
        };
        return static_cast<size_t>(place(s) * kBins + place(t));
      };
      std::vector<double> expected(kBins * kBins, 0), counts(kBins * kBins, 0);
      double sum = 0;
      for (int j = 0; j < kSteps; ++j)
        for (int i = 0; i < kSteps; ++i) {
          const double s = (2 * i + 1.0) / kSteps - 1, t = (2 * j + 1.0) / kSteps - 1;
          const DVec2 q = sheet.point(s, t);
          const DVec3 d = DVec3(q.x, q.y, 0) - DVec3(p);
          const double d2 = glm::dot(d, d);
          double share = 0;
          scene.lights.local.for_each_crossing(
              p, Vec3(0, 0, 1), {p, Vec3(d / std::sqrt(d2)), 0, 1e9},
              [&](const LocalLights::Crossing& c) { share = std::abs(d.z) / (d2 * std::sqrt(d2)) * c.pdf; });
          expected[bin_of(s, t)] += share;
          sum += share;
        }
      for (double& e : expected) e *= kDraws / sum;
      Random random(2);
      int passed_by = 0;
      for (int i = 0; i < kDraws; ++i) {
        const LightSample l =
            scene.lights.local.sample(*scene.surfaces, p, Vec3(0, 0, 1), 0.5f, random.two());
        ASSERT_GT(l.pdf, 0.0f);
        ASSERT_NEAR(length(l.direction), 1, 1e-6);
        const double t = static_cast<double>(p.z) / -l.direction.z;
        const DVec2 q(p.x + t * l.direction.x, p.y + t * l.direction.y);
        const double turn = std::atan2(q.y, q.x) / M_PI;
        counts[sheet.round ? bin_of(2 * glm::dot(q, q) / (sheet.half.x * sheet.half.x) - 1, turn)
                           : bin_of(q.x / sheet.half.x, q.y / sheet.half.y)] += 1;
        float same = 0;
        scene.lights.local.for_each_crossing(p, Vec3(0, 0, 1), {p, l.direction, 0, 1e9},
                                             [&](const LocalLights::Crossing& c) { same = c.pdf; });
        if (same == 0.0f)
          ++passed_by;
        else  // the direction is rounded to 2^-24, which turns it around the cone's axis by more close to it
          ASSERT_NEAR(same, l.pdf, 1e-4f * l.pdf) << sheet.name;
      }
      EXPECT_LE(passed_by, 10) << "samples within rounding of the rim";
      EXPECT_EQ(test::chi_square(expected, counts), "") << sheet.name << " " << p.z;
    }
}

// Lambert 1760, by Baum, Rushmeier & Winget 1989: irradiance from a polygon of radiance 1 above the horizon.
double polygon_irradiance(const DVec3& p, const DVec3& n, const std::vector<DVec3>& polygon) {
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const DVec3 a = glm::normalize(polygon[i] - p), b = glm::normalize(polygon[(i + 1) % polygon.size()] - p);
    const DVec3 axis = glm::cross(a, b);
    const double s = glm::length(axis);
    if (s > 0) sum += std::atan2(s, glm::dot(a, b)) * glm::dot(n, axis / s);
  }
  return 0.5 * std::abs(sum);
}
// From a disc of radius r onto a parallel surface at height h whose foot is d away from the disc's axis
// (Foote 1915).
double disc_irradiance(double r, double d, double h) {
  const double sum = h * h + d * d + r * r;
  return 0.5 * M_PI * (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * r * r * d * d));
}

TEST(AreaLight, GivesTheIrradianceOfTheClosedForms) {
  const DVec3 n(0, 0, 1);
  for (const Sheet& sheet : sheets())
    for (const std::span<const Vec3> list :
         {std::span<const Vec3>(kReceivers), std::span<const Vec3>(kFarReceivers),
          std::span<const Vec3>(kCloseReceivers)})
      for (const Vec3& p : list) {
        const test::LitScene scene = sheet.lit();
        Mean mean;
        Random random(3);
        for (int i = 0; i < 40000; ++i) {
          const LightSample l = scene.lights.local.sample(*scene.surfaces, p, Vec3(n), 0.5f, random.two());
          mean.add(static_cast<double>(l.weight.x) * std::max(0.0f, l.direction.z));
        }
        const DVec2 h = sheet.half;
        const double truth =
            3 * (sheet.round
                     ? disc_irradiance(h.x, glm::length(DVec2(p.x, p.y)), std::abs(p.z))
                     : polygon_irradiance(DVec3(p), n,
                                          {{-h.x, -h.y, 0}, {h.x, -h.y, 0}, {h.x, h.y, 0}, {-h.x, h.y, 0}}));
        EXPECT_NEAR(mean.value(), truth, 4.6 * mean.error() + 2e-6 * truth) << sheet.name << " at " << p.z;
        EXPECT_LT(mean.error(), 0.005 * truth)
            << sheet.name << ": weights of samples by solid angle are bounded";
      }
}

// The weight of every sample is radiance times the solid angle, or, of a disc, within [0.82, 1] of the
// largest.
TEST(AreaLight, WeightsAreTheSolidAngle) {
  for (const Sheet& sheet : sheets()) {
    Random random(4);
    const test::LitScene scene = sheet.lit();
    for (int k = 0; k < 1000; ++k) {
      const float height = std::pow(10.0f, 5 * random.one() - 4);
      const Vec3 p = random.in_box({-3, -3, -height}, {3, 3, -height});
      Mean weights;
      double least = 1e30, most = 0;
      for (int i = 0; i < 200; ++i) {
        const LightSample l =
            scene.lights.local.sample(*scene.surfaces, p, Vec3(0, 0, 1), 0.5f, random.two());
        least = std::min<double>(least, l.weight.x), most = std::max<double>(most, l.weight.x);
      }
      if (most < 1e-5) continue;  // by area
      ASSERT_LE(most, 3 * 2 * M_PI / (sheet.round ? 0.82 : 1) * (1 + 1e-6));
      ASSERT_GE(least / most, sheet.round ? 0.8284 : 1 - 1e-6)
          << sheet.name << " " << p.x << " " << p.y << " " << p.z;
    }
  }
}

TEST(AreaLight, ExtremesStayFinite) {
  struct Extreme {
    const char* what;
    Vec3 p, at;
    double scale;
  };
  const Extreme extremes[] = {{"in the plane, inside", {0.1f, 0.1f, 0}, {0, 0, 0}, 1},
                              {"in the plane, outside", {2, 0.1f, 0}, {0, 0, 0}, 1},
                              {"on the edge", {0.5f, 0, 0}, {0, 0, 0}, 1},
                              {"on the corner", {0.5f, 0.5f, 0}, {0, 0, 0}, 1},
                              {"just off the edge", {0.5f, 0, -2e-5f}, {0, 0, 0}, 1},
                              {"just below the middle", {0, 0, -2e-5f}, {0, 0, 0}, 1},
                              {"nearly in the plane", {100, 3, -1e-3f}, {0, 0, 0}, 1},
                              {"solid angle of 1e-12", {0, 0, -1e6f}, {0, 0, 0}, 1},
                              {"the same, nearly in the plane", {1e6f, 0, -20}, {0, 0, 0}, 1},
                              {"much larger than the distance", {0, 0, -1}, {0, 0, 0}, 1e6},
                              {"the same at its edge", {5e5f, 0, -10}, {0, 0, 0}, 1e6},
                              {"microscopic", {0, 0, -1}, {0, 0, 0}, 1e-12},
                              {"denormal", {0, 0, -1}, {0, 0, 0}, 1e-41},
                              {"astronomic", {0, 0, -1e18f}, {0, 0, 0}, 1e18},
                              {"far from the origin", {1e5f, 1e5f, 1e5f - 1}, {1e5f, 1e5f, 1e5f}, 1}};
  for (const Extreme& e : extremes)
    for (Sheet sheet : sheets()) {
      SCOPED_TRACE(sheet.name + ", " + e.what);
      sheet.half *= e.scale;
      const test::LitScene scene = sheet.lit(e.at);
      const LocalLights& lights = scene.lights.local;
      Random random(5);
      for (int i = 0; i < 2000; ++i) {
        const Vec2 u =
            i < 4 ? Vec2(i & 1 ? 0x1p-24f : 1 - 0x1p-24f, i & 2 ? 0x1p-24f : 1 - 0x1p-24f) : random.two();
        const Vec3 n = random.direction();
        const LightSample l = lights.sample(*scene.surfaces, e.p, n, 0.5f, u);
        ASSERT_TRUE(is_finite(l.weight) && is_finite(l.direction) && is_finite(l.segment));
        ASSERT_TRUE(std::isfinite(l.pdf) && l.pdf >= 0.0f && l.weight.x >= 0.0f);
        if (l.pdf > 0.0f) ASSERT_NEAR(length(l.direction), 1, 1e-6);
        for (const Vec3& d : {n, l.direction, normalize_or(e.at - e.p, n)})
          lights.for_each_crossing(e.p, n, {e.p, d, 0, 1e30}, [](const LocalLights::Crossing& c) {
            ASSERT_TRUE(std::isfinite(c.pdf) && c.pdf >= 0.0f && c.distance >= 0 &&
                        std::isfinite(c.distance));
          });
      }
    }
}

// Whatever side of the plane rounding puts a point of it on: a two-sided light on a wall does not light the
// wall.
TEST(AreaLight, GivesNothingInItsOwnPlane) {
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const Frame frame(random.direction());
    const Vec3 centre = random.in_box(Vec3(-3), Vec3(3));
    SceneMaker m;
    m.lambert(Vec3(0.5f));
    m.quad({-1, 9, -1}, {0, 0, 2}, {2, 0, 0});
    if (k % 2)
      m.disc(centre, frame.n, 1, Vec3(1), 2);
    else
      m.rectangle(centre, frame.x, frame.y, {1, 2}, Vec3(1), 2);
    const test::LitScene scene = test::light_up(m.take());
    for (int i = 0; i < 50; ++i) {
      const Vec3 on = random.in_box(Vec3(-1), Vec3(1));
      const Vec3 p = centre + frame.x * on.x + frame.y * on.y, d = random.direction();
      EXPECT_EQ(scene.lights.local.sample(*scene.surfaces, p, d, 0.5f, random.two()).weight, Vec3(0));
      scene.lights.local.for_each_crossing(p, d, {p, d, -1e9, 1e9},
                                           [](const LocalLights::Crossing&) { ADD_FAILURE(); });
    }
  }
}

TEST(AreaLight, OnlyAreaLightsWantAPoint) {
  for (const Sheet& sheet : sheets()) {
    const test::LitScene scene = sheet.lit();
    EXPECT_TRUE(scene.lights.local.wants_point() && scene.lights.local.has_area_lights());
  }
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-1, 9, -1}, {0, 0, 2}, {2, 0, 0}).point({0, 1, 0}, Vec3(1));
  const test::LitScene lamp = test::light_up(m.take());
  EXPECT_FALSE(lamp.lights.local.wants_point() || lamp.lights.local.has_area_lights());
}

TEST(AreaLight, PowerAndBakeMode) {
  for (const Sheet& sheet : sheets()) {
    const Record record = sheet.lit().surfaces->scene().lights.at(0);
    RecordReader r(record);
    const Scene none;
    const double area = sheet.round ? M_PI * sheet.half.x * sheet.half.x : 4 * sheet.half.x * sheet.half.y;
    const double power =
        sheet.round ? DiscLight::parse(r, record, none)->power() : RectLight::parse(r, record, none)->power();
    EXPECT_NEAR(power, 3 * M_PI * area * sheet.sides, 1e-6 * power);
    EXPECT_TRUE(r.unread().empty());
    for (const auto& [word, lights] : {std::pair{"none", 0u}, {"indirect", 1u}, {"full", 1u}}) {
      Scene scene = sheet.lit().surfaces->scene();
      scene.lights[0].properties.push_back({"bake", {}, word, {}});
      const test::LitScene lit = test::light_up(std::move(scene));
      EXPECT_EQ(lit.lights.local.size(), lights);
      const bool indirect = std::string(word) == "indirect";
      if (lights)
        EXPECT_EQ(lit.lights.local.sample(*lit.surfaces, Vec3(0, 0, -1), Vec3(0, 0, 1), 0, Vec2(0.5f))
                      .indirect_only,
                  indirect);
      lit.lights.local.for_each_crossing(
          Vec3(0, 0, -1), Vec3(0, 0, 1), {Vec3(0, 0, -1), Vec3(0, 0, 1), 0, 9},
          [&](const LocalLights::Crossing& c) { EXPECT_EQ(c.indirect_only, indirect); });
    }
  }
}

TEST(AreaLight, RecordsThatAreNoLightsAreRefused) {
  const auto message = [](const Record& record) {
    LocalLights lights;
    RecordReader r(record);
    const auto added = lights.add(r, record, Scene());
    return added ? std::string("accepted") : added.error().message;
  };
  const Record panel = sheets()[0].lit().surfaces->scene().lights.at(0);
  const Record round = sheets()[3].lit().surfaces->scene().lights.at(0);
  EXPECT_EQ(message(panel), "accepted");
  EXPECT_EQ(message(round), "accepted");
  const auto with = [&](Record record, const char* name, std::vector<double> numbers) {
    for (Property& p : record.properties)
      if (p.name == name) p.numbers = std::move(numbers);
    return message(record);
  };
  const double nan = std::nan(""), inf = HUGE_VAL;
  for (const std::vector<double>& bad :
       std::vector<std::vector<double>>{{}, {1}, {0, 1}, {1, -1}, {nan, 1}, {1, inf}, {1, 1, 1}})
    EXPECT_NE(with(panel, "size", bad).find("rectangle light 'panel': its size"), std::string::npos);
  for (const std::vector<double>& bad : std::vector<std::vector<double>>{{}, {0}, {-1}, {nan}, {inf}, {1, 1}})
    EXPECT_NE(with(round, "radius", bad).find("disc light 'round': its radius"), std::string::npos);
  for (const std::vector<double>& bad :
       std::vector<std::vector<double>>{{}, {0, 0, 0}, {1, -1, 1}, {nan, 1, 1}, {1, inf, 1}})
    EXPECT_NE(with(round, "radiance", bad).find("'round': radiance"), std::string::npos);
  for (const double bad : {0.0, 3.0, nan})
    EXPECT_NE(with(panel, "sides", {bad}).find("'panel': it has"), std::string::npos);
  for (const int column : {0, 1, 3}) {
    Record turned = panel;
    turned.to_world[column].x = std::nanf("");
    EXPECT_NE(message(turned).find("transform"), std::string::npos);
    turned = panel;
    if (column < 3) turned.to_world[column] *= 2.0f;
    if (column < 3) EXPECT_NE(message(turned).find("transform"), std::string::npos);
  }
}

}  // namespace
}  // namespace kiln

// Samplers against their densities, and what every closure must obey, over the whole roster.
#include "common/math/sequence.h"
#include "tests/materials/roster.h"

namespace kiln {
namespace {
using test::direction_at;
using test::layered_materials;
using test::put;

constexpr float kCosines[] = {1.0f, 0.6f, 0.2f, 0.03f};
constexpr double kRoughness[] = {0, 0.5, 1};

// Calls f(material, wo, label) for all.
template <class F>
void for_roster(double albedo, const F& f) {
  for (const double roughness : kRoughness)
    for (const auto& m : layered_materials(roughness, albedo))
      for (const float cos : kCosines)
        f(m.bsdf, direction_at(cos),
          m.name + ", roughness " + std::to_string(roughness) + ", cosine " + std::to_string(cos));
}

// Independent numbers in (0, 1).
struct Random {
  uint64_t state = 1;
  float operator()() {
    return unit_float(static_cast<uint32_t>(mix_bits(state += 0x9e3779b97f4a7c15u) >> 32));
  }
};

constexpr int kRings = 8, kSectors = 8, kBins = kRings * kSectors;

// Rings of equal width in r, z = 1 - r^2: narrow lobes around the normal get their share of cells.
int bin_of(const Vec3& d) {
  const float r = std::sqrt(std::max(0.0f, 1.0f - d.z));
  const float turns = atan2_turns(d.y, d.x) + 0.5f;
  return std::min(static_cast<int>(r * kRings), kRings - 1) * kSectors +
         std::min(static_cast<int>(turns * kSectors), kSectors - 1);
}

struct Integrals {
  double pdf[kBins] = {};
  double total = 0, albedo = 0;
};
// Cells of 1/384 in r, a third of the narrowest lobe's width at most. Across, a lobe seen under a cosine is
// that much narrower.
Integrals integrate(const BsdfAtWo& seen, float cos) {
  constexpr int kFine = 48;
  const int across = cos < 0.5f ? 6 * kFine : 2 * kFine;
  Integrals out;
  for (int a = 0; a < kRings * kFine; ++a)
    for (int b = 0; b < kSectors * across; ++b) {
      const double r = (a + 0.5) / (kRings * kFine), turns = (b + 0.5) / (kSectors * across);
      const double area = 2 * r / (kRings * kFine) * (2 * M_PI / (kSectors * across));
      const Vec3 d = spherical(static_cast<float>(1 - r * r), static_cast<float>(turns - 0.5));
      const BsdfValue v = seen.value(d);
      out.pdf[a / kFine * kSectors + b / across] += v.pdf * area;
      out.total += v.pdf * area;
      out.albedo += static_cast<double>(max_component(v.f)) * d.z * area;
    }
  return out;
}

// Chi-square of directions against the integrated density, those below the horizon in a bin of their own: it
// holds that the missing mass of the density is the share of samples that end there. Bins of less than ten
// are pooled.
TEST(Roster, DirectionsFollowTheirDensity) {
  constexpr int kSamples = 20000;
  // Wilson & Hilferty 1931 at 5.3 standard deviations: 1e-4 shared among fewer than 1,000 tests (5.8e-8
  // each).
  constexpr double kDeviations = 5.3;
  Random random;
  for_roster(0.7, [&](const Bsdf& bsdf, const Vec3& wo, const std::string& label) {
    if (wo.z < 0.1f) return;  // the quadrature's cells are too coarse for lobes at grazing angles
    const BsdfAtWo seen(bsdf, wo);
    const Integrals truth = integrate(seen, wo.z);
    EXPECT_LE(truth.total, 1.003) << label;
    int counts[kBins + 1] = {};
    for (int i = 0; i < kSamples; ++i) {
      const float layer = random();
      const Vec2 u(random(), random());
      const BsdfSample s = seen.sample(layer, u);
      ++counts[s.direction.z > 0.0f ? bin_of(s.direction) : kBins];
    }
    double chi2 = 0, pooled_truth = 0, pooled = 0;
    int freedom = -1;
    const auto add = [&](double expected, double counted) {
      chi2 += (counted - expected) * (counted - expected) / expected;
      ++freedom;
    };
    for (int k = 0; k <= kBins; ++k) {
      const double expected = kSamples * (k < kBins ? truth.pdf[k] : std::max(0.0, 1 - truth.total));
      if (expected < 10) {
        pooled_truth += expected;
        pooled += counts[k];
      } else {
        add(expected, counts[k]);
      }
    }
    if (pooled_truth > 1) add(pooled_truth, pooled);
    if (freedom < 1) return;
    const double n = freedom, w = 1 - 2 / (9 * n) + kDeviations * std::sqrt(2 / (9 * n));
    // Quadrature errs by up to 0.3 % of the mass: seen as chi-square 20,000 x 0.003^2.
    EXPECT_LE(chi2, n * w * w * w + kSamples * 0.003 * 0.003) << label;
  });
}

TEST(Roster, ReflectsNoMoreThanItReceives) {
  for (const double albedo : {0.0, 1.0})
    for_roster(albedo, [&](const Bsdf& bsdf, const Vec3& wo, const std::string& label) {
      const BsdfAtWo seen(bsdf, wo);
      constexpr uint32_t kSamples = 4096;
      double mean = 0, square = 0;
      for (uint32_t i = 0; i < kSamples; ++i) {
        const SampleStream stream(1, 2, i);
        const BsdfSample s = seen.sample(stream.single(0), stream.pair(1));
        const double w = max_component(s.weight);
        ASSERT_TRUE(w >= 0 && std::isfinite(w)) << label;
        ASSERT_LT(w, 30) << label;  // no fireflies: each lobe's own bound over its least share of a tenth
        mean += w, square += w * w;
      }
      mean /= kSamples;
      const double error = std::sqrt(std::max(0.0, square / kSamples - mean * mean) / kSamples);
      // Glass counts with what it lets through. Rough layers may top it by 0.0022 there (docs/maths.md).
      const double through = max_component(straight_through(bsdf, wo.z));
      EXPECT_LE(mean + through, 1 + 4 * error + (through > 0 ? 0.0022 : 1e-6)) << label;
    });
}

// White materials keep energy at every angle and in the mean: what the layers do not reflect, the lobes below
// do.
TEST(Roster, WhiteNeitherLosesNorGains) {
  double least = 1, most = 1;
  for (const double roughness : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0})
    for (const auto& m : layered_materials(roughness, 1)) {
      if (m.bsdf.has_sheen() && m.bsdf.has_specular()) continue;  // loses light between the two
      for (const float cos : {1.0f, 0.8f, 0.5f, 0.3f, 0.1f}) {
        const double all = test::white_furnace(m.bsdf, cos, 1u << 15);
        // A smooth pane lets 1 - F through; the narrowest lobe reflects less than F at grazing angles.
        const bool is_pane = roughness == 0 && max_component(m.bsdf.transmission) > 0 && !m.bsdf.is_covered();
        const float f = m.bsdf.under_f0 + (m.bsdf.under_f90 - m.bsdf.under_f0) * fifth_power_of_rest(cos);
        const float missing =
            is_pane ? f - GgxAlbedo(m.bsdf.alpha).albedo(cos).of(m.bsdf.under_f0, m.bsdf.under_f90) : 0.0f;
        EXPECT_NEAR(all, 1 - max_component(m.bsdf.transmission) * missing, 0.002)
            << m.name << ", roughness " << roughness << ", cosine " << cos;
        least = std::min(least, all), most = std::max(most, all);
      }
    }
  std::printf("white, without sheen over a layer: %.4f to %.4f\n", least, most);
}

TEST(Roster, IsReciprocalAndWeighsByItsDensity) {
  Random random;
  for_roster(0.7, [&](const Bsdf& bsdf, const Vec3& wo, const std::string& label) {
    const BsdfAtWo seen(bsdf, wo);
    for (int i = 0; i < 64; ++i) {
      const float layer = random();
      const BsdfSample s = seen.sample(layer, {random(), random()});
      const BsdfValue v = seen.value(s.direction);
      ASSERT_EQ(s.pdf, v.pdf) << label;
      if (!(s.pdf > 0.0f)) continue;
      const Vec3 weight = v.f * (s.direction.z / v.pdf);
      ASSERT_LE(length(s.weight - weight), 1e-5f * length(weight)) << label;
      if (s.direction.z < 1e-3f) continue;
      const Vec3 back = BsdfAtWo(bsdf, s.direction).value(wo).f;
      // A dozen roundings, and the half vector's in a lobe of width 0.02: 2^-23 / 0.02^2 of its height.
      ASSERT_LE(length(back - v.f), 2e-3f * length(v.f) + 1e-7f) << label;
    }
  });
}

TEST(Roster, BelowTheHorizonThereIsNothing) {
  for_roster(1, [&](const Bsdf& bsdf, const Vec3& wo, const std::string& label) {
    EXPECT_EQ(BsdfAtWo(bsdf, wo).value({0.6f, 0, -0.8f}).pdf, 0.0f) << label;
    EXPECT_EQ(max_component(BsdfAtWo(bsdf, -wo).sample(0.5f, {0.5f, 0.5f}).weight), 0.0f) << label;
    for (const float cos : {1e-6f, 1e-20f, 0.0f}) {
      const BsdfSample s = BsdfAtWo(bsdf, direction_at(cos)).sample(0.3f, {0.2f, 0.7f});
      EXPECT_TRUE(is_finite(s.weight) && std::isfinite(s.pdf)) << label << cos;
    }
  });
}

// The specification's own form where both agree: at normal incidence and exit the layers share by Fresnel.
TEST(Layers, MetalAndDielectricMixAsTheSpecificationHasIt) {
  const Bsdf b = bsdf_at(test::material_of({put("metallic", {0.25}), put("base_color", {0.8, 0.4, 0.2, 1}),
                                            put("specular", {0.5}), put("specular_color", {1, 0.5, 2})}),
                         {});
  EXPECT_NEAR(b.diffuse.x, 0.75f * 0.8f, 1e-6f);
  EXPECT_NEAR(b.f0.x, 0.75f * 0.5f * 0.04f + 0.25f * 0.8f, 1e-6f);
  EXPECT_NEAR(b.f0.z, 0.75f * 0.5f * 0.08f + 0.25f * 0.2f, 1e-6f);
  EXPECT_NEAR(b.f90, 0.75f * 0.5f + 0.25f, 1e-6f);
  EXPECT_NEAR(b.under_f0, 0.5f * 0.08f, 1e-6f);
}

TEST(Layers, SayWhatASceneNeeds) {
  const auto layers = [](std::vector<Property> p) { return layers_of(test::material_of(std::move(p))); };
  EXPECT_EQ(layers({put("metallic", {0}), put("specular", {0})}), Layers::kLambert);
  EXPECT_EQ(layers({put("metallic", {0}), put("ior", {1})}), Layers::kLambert);
  EXPECT_EQ(layers({put("metallic", {0})}), Layers::kGgx);
  EXPECT_EQ(layers({put("sheen_color", {0, 0, 0})}), Layers::kGgx);
  EXPECT_EQ(layers({put("sheen_color", {0, 1, 0})}), Layers::kGeneral);
  EXPECT_EQ(layers({put("transmission", {1})}), Layers::kGeneral);
}

// A material whose layers are the same everywhere computes once what they leave to the lobes below. Any base
// colour below them gives the bits that a closure of its own gives.
TEST(Layers, WhatTheyKeepIsTheSameComputedAhead) {
  for (const double metallic : {0.0, 0.3, 1.0})
    for (const double roughness : {0.1, 1.0}) {
      const Material m = test::material_of({put("metallic", {metallic}), put("roughness", {roughness})});
      for (const Vec4& color : {Vec4(0.9f, 0.5f, 0.1f, 1.0f), Vec4(0.0f, 0.2f, 1.0f, 1.0f)}) {
        Attributes a;
        a.color = color;
        const Bsdf ahead = bsdf_at(m, a);
        ASSERT_TRUE(ahead.kept);
        Bsdf own = ahead;
        own.kept = nullptr;
        BsdfAtWo one(ahead, test::direction_at(0.4f)), other(own, test::direction_at(0.4f));
        const Vec3 wi = test::direction_at(0.7f);
        for (int taken = 0; taken < 2; ++taken) {
          EXPECT_EQ(one.value(wi).f, other.value(wi).f);
          EXPECT_EQ(one.value(wi).pdf, other.value(wi).pdf);
          EXPECT_EQ(one.lambert_share(), other.lambert_share());
          EXPECT_EQ(one.chance_of_rest(), other.chance_of_rest());
          one.take_lambert_share();
          other.take_lambert_share();
        }
      }
    }
  // Sheen and coat are not computed ahead, and a Lambert surface has no layers.
  EXPECT_FALSE(bsdf_at(test::material_of({put("clearcoat", {1})}), {}).kept);
  EXPECT_FALSE(bsdf_at(test::material_of({put("metallic", {0}), put("specular", {0})}), {}).kept);
}

TEST(Layers, HostileNumbersAreTamed) {
  const double nan = std::nan(""), inf = INFINITY;
  for (const double bad : {nan, inf, -inf, -1.0, 7.0, 1e300}) {
    const Material m = test::material_of(
        {put("base_color", {bad, bad, bad, bad}), put("metallic", {bad}), put("roughness", {bad}),
         put("ior", {bad}), put("specular", {bad}), put("specular_color", {bad, bad, bad}),
         put("emission", {bad, bad, bad}), put("transmission", {bad}), put("absorption", {bad, bad, bad}),
         put("clearcoat", {bad}), put("clearcoat_roughness", {bad}), put("sheen_color", {bad, bad, bad}),
         put("sheen_roughness", {bad})});
    const Bsdf b = bsdf_at(m, {});
    for (const float cos : kCosines) {
      const BsdfSample s = BsdfAtWo(b, direction_at(cos)).sample(0.4f, {0.3f, 0.6f});
      EXPECT_TRUE(is_finite(s.weight) && max_component(-s.weight) <= 0.0f) << bad;
      EXPECT_LE(max_component(straight_through(b, cos)), 1.0f) << bad;
    }
    EXPECT_TRUE(is_finite(emission_at(m, {}))) << bad;
    EXPECT_GE(opacity_at(m, {}), 0.0f);
  }
}

}  // namespace
}  // namespace kiln

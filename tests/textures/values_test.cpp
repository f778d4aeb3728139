// Scales, ratios and lookups of textures, and the error that is stated of them.
#include "common/atlas/texel_normals.h"
#include "coordinator/output/textures/texel_codec.h"
#include "coordinator/output/textures/texture_error.h"
#include "coordinator/output/textures/texture_values.h"
#include "tests/textures/maps.h"

namespace kiln::test {
namespace {

const BasisInfo& sh_l1() {
  return basis_roster()[*find_basis("sh_l1")];
}

struct Laid {
  std::vector<TextureLayout> layouts;
  std::vector<TextureScale> scales;
  std::vector<std::vector<float>> values;
  uint64_t clamped = 0;

  Laid(const char* name, const MapLevel& level, bool fit = false, Quantity q = Quantity::kBasis)
      : layouts(layouts_of(encoding(name), sh_l1(), q)) {
    for (const TextureLayout& l : layouts) {
      scales.push_back(choose_scale(l, level, fit, 1));
      values.push_back(texture_values(l, level, scales.back(), &clamped));
    }
  }
  std::vector<DecodedTexture> decoded() const {
    std::vector<DecodedTexture> out;
    for (size_t k = 0; k < layouts.size(); ++k) out.push_back({&layouts[k], scales[k], values[k]});
    return out;
  }
};

TEST(TextureValues, PlanesComeBack) {
  const Baked b = baked_box(8, smooth_light());
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  for (const char* name : {"bc6h", "bc6h-plain", "half", "rgb9e5"})
    for (const bool fit : {false, true}) {
      const Laid laid(name, level, fit);
      EXPECT_EQ(laid.clamped, 0u);
      const std::vector<DecodedTexture> textures = laid.decoded();
      for (size_t t = 0; t < level.owner.size(); ++t) {
        if (!level.owner[t]) continue;
        const size_t one[1] = {t};
        const float weight[1] = {1};
        float planes[12];
        lookup_planes(textures, one, weight, planes);
        for (size_t p = 0; p < 12; ++p) {
          const float want = level.planes.plane(laid.layouts[p / 3].plane[p % 3])[t];
          // A ratio in [0, 1] as float: 2^-24 of twice L0 for the value, as much for each of the products.
          ASSERT_NEAR(planes[p], want, 6 * 0x1p-24 * level.planes.plane(laid.layouts[0].plane[p % 3])[t]);
        }
      }
    }
}

TEST(TextureValues, NoLightHasNoDirectionAndTooMuchIsCounted) {
  Baked b = baked_box(8, smooth_light());
  size_t first = 0;
  while (!b.atlas.owner[first]) ++first;
  Planes& p = b.map.planes;
  for (const char* plane : {"L0.R", "L0.G", "L0.B", "L1x.R", "L1y.R", "L1z.R"}) p.plane(plane)[first] = 0;
  p.plane("L1x.G")[first] = 0.25f;  // a direction without light: noise of a fill
  p.plane("L1x.R")[first + 1] = 3 * p.plane("L0.R")[first + 1];
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  const Laid laid("bc6h", level);
  EXPECT_EQ(laid.clamped, 1u);
  EXPECT_EQ(laid.values[1][4 * first], 0.5f);
  EXPECT_EQ(laid.values[1][4 * first + 1], 0.5f);
  EXPECT_EQ(laid.values[1][4 * (first + 1)], 1.0f);
}

TEST(TextureValues, ScaleIsAPowerOfTwoThatFits) {
  for (const double scale : {1e-12, 1e-3, 1.0, 1e4, 1e6, 1e12}) {
    const Baked b = baked_box(4, [&](uint32_t x, uint32_t y) {
      Light l = smooth_light()(x, y);
      for (double& v : l.l0) v *= scale;
      return l;
    });
    const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
    for (const char* name : {"bc6h", "rgb9e5", "rgbm", "rgbd", "rgbe", "half"}) {
      const Laid laid(name, level);
      int exponent;
      EXPECT_EQ(std::frexp(laid.scales[0].scale, &exponent), 0.5);
      EXPECT_EQ(laid.clamped, 0u) << name << scale;
      const ValueRange range = value_range(laid.layouts[0].format, laid.layouts[0].unpack);
      float most = 0;
      for (size_t i = 0; i < laid.values[0].size(); ++i)
        if (i % 4 < 3) most = std::max(most, laid.values[0][i]);
      EXPECT_LE(most, range.highest);
      if (scale == 1 && std::string(name) != "rgbm") {
        EXPECT_EQ(laid.scales[0].scale, 1);
      }
      if (range.highest == 65504) {
        EXPECT_GE(most, 1.0 / 64);  // steps of a half are 2^-11 relative
      }
    }
  }
}

TEST(TextureError, IsNothingForWhatIsExact) {
  const Baked b = baked_box(8, smooth_light());
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  const Laid laid("bc6h-plain", level);
  const std::vector<Vec3> normals = texel_normals(b.scene, b.atlas);
  const TextureError e = measure_texture_error(level, &sh_l1(), normals, laid.decoded(), laid.decoded());
  EXPECT_EQ(e.rel_mse_texels, 0);
  // Means of four in another order of roundings.
  EXPECT_LT(e.rel_mse_between, 1e-12);
  EXPECT_GT(e.psnr_log, 120);
  EXPECT_GT(e.between, e.texels / 2);
}

// L0' = 1.01 L0 and the same ratios: E' = 1.01 E for every normal, and the mean of E(n)^2 over the mean of
// E(n), squared, follows from the basis by the same sum.
TEST(TextureError, IsWhatWasPutIn) {
  const Baked b = baked_box(8, [](uint32_t, uint32_t) { return Light{{2, 2, 2}, {0, 0, 0}}; });
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  Laid laid("bc6h", level);
  const Laid exact = laid;
  for (float& v : laid.values[0]) v *= 1.01f;
  std::vector<float> picture;
  const TextureError e = measure_texture_error(level, &sh_l1(), texel_normals(b.scene, b.atlas),
                                               laid.decoded(), exact.decoded(), &picture);
  // E = 2 pi everywhere: (0.01)^2 / (1 + 1e-4).
  const double want = 1e-4 / 1.0001;
  EXPECT_NEAR(e.rel_mse, want, want * 1e-4);
  for (const TextureError::AtNormal& at : e.at_normal) {
    EXPECT_NEAR(at.rms, std::sqrt(want), 1e-4 * std::sqrt(want)) << at.degrees;
    EXPECT_NEAR(at.bias, std::sqrt(want), 1e-4 * std::sqrt(want)) << at.degrees;
  }
  EXPECT_NEAR(e.worst_block.error, std::sqrt(want), 1e-5);
  EXPECT_NEAR(e.worst_texel.error, std::sqrt(want), 1e-5);
  EXPECT_NEAR(*std::max_element(picture.begin(), picture.end()), std::sqrt(want), 1e-5);
  EXPECT_EQ(e.rel_mse_filter, 0);
}

// Filtering L0 and L1/L0 apart: the mean of two products is not the product of the means. For columns a, p
// and b, q the difference is (a - b)(p - q)/4.
TEST(TextureError, KnowsWhatFilteringApartCosts) {
  const double a = 1, z = 3, p = 0.4, q = -0.2;
  const Baked b = baked_box(8, [&](uint32_t x, uint32_t) {
    return x % 2 ? Light{{z, z, z}, {0, 0, q}} : Light{{a, a, a}, {0, 0, p}};
  });
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  const Laid laid("bc6h", level), plain("bc6h-plain", level);
  const std::vector<Vec3> normals = texel_normals(b.scene, b.atlas);
  const TextureError e = measure_texture_error(level, &sh_l1(), normals, laid.decoded(), laid.decoded());
  EXPECT_LT(e.rel_mse_texels, 1e-12);
  double want = 0;
  uint64_t count = 0;
  double map_mean = 0;
  uint64_t texels = 0;
  for (size_t t = 0; t < level.owner.size(); ++t)
    if (level.owner[t]) map_mean += kPi * level.planes.plane("L0.R")[t], ++texels;
  map_mean /= static_cast<double>(texels);
  for (size_t t = 0; t < level.owner.size(); ++t) {
    const size_t w = level.planes.width;
    if (!level.owner[t] || t % w + 1 >= w || t / w + 1 >= level.page_height) continue;
    if (level.owner[t + 1] != level.owner[t] || level.owner[t + w] != level.owner[t] ||
        level.owner[t + w + 1] != level.owner[t])
      continue;
    Vec3 n[kErrorNormals];
    hemisphere_normals(normals[t], n);
    double squares = 0, mean = 0;
    for (const Vec3& d : n) {
      const double l0 = (a + z) / 2, l1 = (a * p + z * q) / 2;
      mean += kPi * (l0 + 2 * l1 * d.z) / kErrorNormals;
      const double off = 2 * kPi * (a - z) * (p - q) / 4 * d.z;
      squares += off * off / kErrorNormals;
    }
    want += squares / (mean * mean + 1e-4 * map_mean * map_mean);
    ++count;
  }
  want /= static_cast<double>(count);
  EXPECT_NEAR(e.rel_mse_filter, want, 1e-4 * want);
  EXPECT_NEAR(e.rel_mse_between, want, 1e-4 * want);
  EXPECT_LT(measure_texture_error(level, &sh_l1(), normals, plain.decoded(), plain.decoded()).rel_mse_filter,
            1e-12);
}

TEST(TexelNormals, AreTheFacesOutwardNormals) {
  const Baked b = baked_box(8, smooth_light());
  const std::vector<Vec3> normals = texel_normals(b.scene, b.atlas);
  std::vector<Vec3> met;
  for (size_t t = 0; t < normals.size(); ++t) {
    if (!b.atlas.owner[t]) {
      EXPECT_EQ(normals[t], Vec3(0.0f));
      continue;
    }
    EXPECT_NEAR(length(normals[t]), 1, 1e-5);
    if (std::find(met.begin(), met.end(), normals[t]) == met.end()) met.push_back(normals[t]);
  }
  EXPECT_EQ(met.size(), 6u);
  Vec3 around[kErrorNormals], sum(0.0f);
  hemisphere_normals(Vec3(0, 0, -1), around);
  for (const Vec3& n : around) {
    EXPECT_GT(dot(n, Vec3(0, 0, -1)), 0);
    sum += n;
  }
  // Even in solid angle: the mean of the cosine is 1/2.
  EXPECT_NEAR(-sum.z / kErrorNormals, 0.5, 1e-5);
}

}  // namespace
}  // namespace kiln::test

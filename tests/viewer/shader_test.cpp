// docs/shaders/kiln_lightmap.glsl gives what common/responses/evaluate.h gives.
#include <cstring>
#include <random>

#include "common/base/files.h"
#include "common/responses/evaluate.h"
#include "coordinator/output/textures/pixel_codes.h"
#include "tests/viewer/node_tools.h"

namespace kiln {
namespace {

constexpr size_t kIn = 24, kOut = 20;

Vec3 unit(std::mt19937& random) {
  std::normal_distribution<float> gauss;
  return normalize_or(Vec3(gauss(random), gauss(random), gauss(random)), Vec3(0, 0, 1));
}

// Records of 24 floats: light from nearly everywhere to beyond one direction, none at all, and no direction.
std::vector<float> records(size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> number(0, 1);
  std::vector<float> out;
  for (size_t i = 0; i < count; ++i) {
    float r[kIn] = {};
    const float length = i % 7 == 0 ? 0.0f : 1.2f * number(random);
    const Vec3 main = unit(random);
    for (int c = 0; c < 3; ++c) {
      const float l0 = i % 11 == 0 ? 0.0f : number(random) * 10;
      const Vec3 l1 = (main + 0.2f * unit(random)) * (l0 * length / 1.2f);
      r[c] = l0;
      for (int k = 0; k < 3; ++k) r[3 + 3 * k + c] = l1[k];
    }
    const Vec3 n = i % 5 == 0 ? main : unit(random), v = normalize_or(n + 0.9f * unit(random), n);
    for (int k = 0; k < 3; ++k) {
      r[12 + k] = n[k];
      r[15 + k] = v[k];
      r[18 + k] = 0.04f + 0.5f * number(random);
    }
    r[21] = 0.1f + 0.9f * number(random);  // roughness; with the two behind it a texel to unpack
    r[22] = static_cast<float>(1 + random() % 255) / 255;
    r[23] = static_cast<float>(100 + random() % 60) / 255;
    out.insert(out.end(), r, r + kIn);
  }
  return out;
}

TEST(Shader, GivesWhatTheReferenceGives) {
  if (const auto why = test::no_node_tools(true)) GTEST_SKIP() << *why;
  test::TempDir dir;
  const std::vector<float> in = records(2000);
  ASSERT_TRUE(write_file_atomic(dir.path() / "in", bytes_of(in)));
  const auto ran =
      test::run_command(test::node_script("glsl.mjs") + " '" +
                        (test::source_dir() / "docs/shaders/kiln_lightmap.glsl").string() + "' '" +
                        (dir.path() / "in").string() + "' '" + (dir.path() / "out").string() + "'");
  ASSERT_EQ(ran.exit_status, 0) << ran.output;
  const Bytes bytes = *read_file(dir.path() / "out");
  std::vector<float> out(bytes.size() / 4);
  std::memcpy(out.data(), bytes.data(), bytes.size());
  ASSERT_EQ(out.size(), in.size() / kIn * kOut);
  // GLSL ES 3.00 leaves pow, division and square root a few units in the last place, and pow(x, y) is exp2(y
  // log2 x) there: 2^-21 of a value with exponents to 3. Sums cancel against pi (L0 + 2 |L1|); the lobe of
  // GGX divides by a square that cancels down to alpha^2, at least 1e-4 here, of numbers of 1.
  constexpr float kRelative = 0x1p-18f;
  for (size_t i = 0; i < in.size() / kIn; ++i) {
    const float *r = &in[i * kIn], *o = &out[i * kOut];
    ShL1Texel t;
    for (int c = 0; c < 3; ++c) {
      t.l0[c] = r[c];
      for (int k = 0; k < 3; ++k) t.l1[k][c] = r[3 + 3 * k + c];
    }
    const Vec3 n(r[12], r[13], r[14]), v(r[15], r[16], r[17]), f0(r[18], r[19], r[20]);
    const Vec3 linear = irradiance_linear(t, n), curved = irradiance_nonlinear(t, n);
    const float roughness = r[21];
    const Vec3 specular = specular_from_l1(t, n, v, roughness, f0);
    const DominantLight d = dominant_light(t, n);
    for (int c = 0; c < 3; ++c) {
      const float scale = kPi * 4 * t.l0[c] + 1e-6f;
      EXPECT_NEAR(o[c], linear[c], kRelative * scale) << i;
      EXPECT_NEAR(o[4 + c], curved[c], kRelative * scale) << i;
      EXPECT_NEAR(o[8 + c], specular[c], 0x1p-8f * specular[c] + 1e-5f * scale) << i;
      EXPECT_NEAR(o[12 + c], d.direction[c], 0x1p-18f) << i;
    }
    EXPECT_NEAR(o[15], d.focus, kRelative) << i;
    // The texel (f0.b, roughness, r[22], r[23]).
    float rgbm[3], rgbd[3], rgbe[3];
    unpack_texel(Unpack::kRgbm, &r[20], rgbm);
    unpack_texel(Unpack::kRgbd, &r[20], rgbd);
    unpack_texel(Unpack::kRgbe, &r[20], rgbe);
    EXPECT_NEAR(o[16], rgbm[0], kRelative * rgbm[0]);
    EXPECT_NEAR(o[17], 8 * rgbd[1], kRelative * 8 * rgbd[1]);
    EXPECT_NEAR(o[18], rgbe[2], kRelative * rgbe[2]);
    EXPECT_NEAR(o[19], r[21] * 0.5f + 0.25f, kRelative);
  }
}

}  // namespace
}  // namespace kiln

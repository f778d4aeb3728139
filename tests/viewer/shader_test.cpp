// docs/shaders/kiln_lightmap.glsl gives what common/responses/evaluate.h gives, and kiln_bases.glsl what the
// other bases and lobes_specular.h give.
#include <cstring>
#include <random>

#include "common/base/files.h"
#include "common/responses/evaluate.h"
#include "common/responses/lobes_specular.h"
#include "common/responses/receiver_frame.h"
#include "coordinator/output/textures/pixel_codes.h"
#include "coordinator/scene/imageio/exr.h"
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

// What a shader makes of records, by tests/node/glsl.mjs; empty after a failure.
std::vector<float> run_shader(const std::string& program, const std::string& shaders,
                              const std::vector<float>& in, const std::vector<float>& response = {}) {
  test::TempDir dir;
  EXPECT_TRUE(write_file_atomic(dir.path() / "in", bytes_of(in)));
  EXPECT_TRUE(write_file_atomic(dir.path() / "response", bytes_of(response)));
  const auto ran =
      test::run_command(test::node_script("glsl.mjs") + " " + program + " '" + shaders + "' '" +
                        (dir.path() / "in").string() + "' '" + (dir.path() / "out").string() + "'" +
                        (response.empty() ? "" : " '" + (dir.path() / "response").string() + "'"));
  EXPECT_EQ(ran.exit_status, 0) << ran.output;
  if (ran.exit_status != 0) return {};
  const Bytes bytes = *read_file(dir.path() / "out");
  std::vector<float> out(bytes.size() / 4);
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

std::string shader(const char* name) {
  return (test::source_dir() / "docs/shaders" / name).string();
}

TEST(Shader, GivesWhatTheReferenceGives) {
  if (const auto why = test::no_node_tools(true)) GTEST_SKIP() << *why;
  const std::vector<float> in = records(2000);
  const std::vector<float> out = run_shader("lightmap", shader("kiln_lightmap.glsl"), in);
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

// The file of docs/shaders is what this program computes, as halves: basis_table response FILE writes it.
Expected<std::vector<float>> stored_response() {
  KILN_TRY(const Planes file, read_exr(shader("kiln_dice_response.exr")));
  std::vector<float> out;
  for (size_t i = 0; i < size_t{file.width} * file.height; ++i)
    out.insert(out.end(), {file.plane("R")[i], file.plane("G")[i]});
  return out;
}

TEST(Shader, DiceResponseIsStored) {
  const auto stored = stored_response();
  ASSERT_TRUE(stored) << stored.error().message;
  const std::vector<DiceResponse::Scale>& entries = DiceResponse::get().entries();
  ASSERT_EQ(stored->size(), 2 * entries.size());
  for (size_t i = 0; i < entries.size(); ++i) {
    EXPECT_NEAR((*stored)[2 * i], entries[i].f0, 0x1p-11f * entries[i].f0 + 0x1p-24f) << i;
    EXPECT_NEAR((*stored)[2 * i + 1], entries[i].f90, 0x1p-11f * entries[i].f90 + 0x1p-24f) << i;
  }
}

constexpr size_t kBasesIn = 52, kBasesOut = 48;

// Records of 52 floats: functions of both signs, and normals that a normal map turns by up to 60 degrees.
std::vector<float> basis_records(size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> number(0, 1);
  std::vector<float> out;
  for (size_t i = 0; i < count; ++i) {
    float r[kBasesIn] = {};
    for (size_t k = 0; k < 36; ++k) r[k] = 10 * number(random) * number(random) - (i % 3 == 0 ? 1.0f : 0.0f);
    const Vec3 n = i % 9 == 0 ? Vec3(0, 0, 1) : unit(random);
    const Vec3 m = i % 4 == 0 ? n : normalize_or(n + 0.7f * unit(random), n);
    const Vec3 v = i % 8 == 1 ? m : normalize_or(m + 0.98f * unit(random), m);
    for (int k = 0; k < 3; ++k)
      r[36 + k] = n[k], r[39 + k] = m[k], r[42 + k] = v[k], r[45 + k] = number(random);
    r[48] = i % 10 == 0 ? 0.2f : 0.2f + 0.8f * number(random);
    out.insert(out.end(), r, r + kBasesIn);
  }
  return out;
}

struct ShaderBasis {
  const char* name;
  size_t out, specular;  // where in the output; 0: none
  const LobeSet& (*set)();
};
constexpr ShaderBasis kShaderBases[] = {{"sh_l2", 0, 0, nullptr},   {"h6", 4, 0, nullptr},
                                        {"ad9", 8, 24, ad9_lobes},  {"ad12", 12, 28, ad12_lobes},
                                        {"sg9", 16, 32, sg9_lobes}, {"sg12", 20, 36, sg12_lobes}};

void expect_basis(const ShaderBasis& b, const float* r, const float* o) {
  const BasisInfo& info = basis_roster()[*find_basis(b.name)];
  const Vec3 n(r[36], r[37], r[38]), m(r[39], r[40], r[41]), v(r[42], r[43], r[44]), f0(r[45], r[46], r[47]);
  LobeTexel texel{};
  float largest = 0;
  for (size_t k = 0; k < info.functions.size(); ++k) {
    texel.lobe[k] = Vec3(r[3 * k], r[3 * k + 1], r[3 * k + 2]);
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(texel.lobe[k][c]));
  }
  for (int c = 0; c < 3; ++c) {
    float f[kMaxBasisFunctions];
    for (size_t k = 0; k < info.functions.size(); ++k) f[k] = texel.lobe[k][c];
    // Sums of up to 12 numbers of which each counts 15 pi / 4 times at most.
    EXPECT_NEAR(o[b.out + c], info.irradiance(f, n, m), 0x1p-16f * largest * 15) << b.name;
  }
  if (!b.set) return;
  const Vec3 shown = lobes_specular(b.set(), texel, n, m, v, r[48], f0);
  // The response: halves, and 8-bit weights between neighbours that differ by a third at most. Gaussians: x
  // is up to 2 / a2 / 0.08, which multiplies the rounding of the axes.
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(o[b.specular + c], shown[c], 0x1p-9f * (shown[c] + 0.1f * largest)) << b.name;
}

TEST(Shader, BasesGiveWhatTheReferenceGives) {
  if (const auto why = test::no_node_tools(true)) GTEST_SKIP() << *why;
  const auto response = stored_response();
  ASSERT_TRUE(response) << response.error().message;
  const std::vector<float> in = basis_records(2000);
  const std::vector<float> out =
      run_shader("bases", shader("kiln_lightmap.glsl") + "," + shader("kiln_bases.glsl"), in, *response);
  ASSERT_EQ(out.size(), in.size() / kBasesIn * kBasesOut);
  for (size_t i = 0; i < in.size() / kBasesIn; ++i) {
    const float *r = &in[i * kBasesIn], *o = &out[i * kBasesOut];
    for (const ShaderBasis& b : kShaderBases) expect_basis(b, r, o);
    const ReceiverFrame frame(Vec3(r[36], r[37], r[38]));
    // Divided by 1 + q.n, which is small near -q.
    const float slack = 0x1p-20f / std::max(1e-4f, 1 + (2 * r[36] + 3 * r[37] + 6 * r[38]) / 7);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(o[40 + c], frame.x[c], slack) << i;
      EXPECT_NEAR(o[44 + c], frame.y[c], slack) << i;
    }
    ASSERT_FALSE(testing::Test::HasFailure()) << i;
  }
}

}  // namespace
}  // namespace kiln

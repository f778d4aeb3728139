// Files of probes for engines, read back by readers of their own.
#include "common/base/files.h"

#include <cstring>

#include "common/probes/octahedral.h"
#include "common/probes/query.h"
#include "coordinator/output/probes/bevy.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/output/probes/shader_textures.h"
#include "coordinator/output/textures/pixel_codes.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/probes/bricks.h"
#include "tests/analytic/scene_maker.h"
#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace {

// A volume of two spacings with light that varies smoothly.
struct Baked {
  ProbeVolume volume;
  ProbeField field;
};
Baked baked() {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.box({1, 1, 1}, {1.5f, 1.5f, 1.5f}, false);
  ProbeBox box;
  box.spacing = 0.5;
  box.max_spacing = 1;
  box.high = DVec3(6, 3, 9);
  auto placed = place_bricks(box, world_triangles(m.take()), 0, 100000);
  Baked out{placed->volume, {}};
  for (const UVec3& point : placed->points) {
    const Vec3 p(out.volume.place(point));
    Harmonics light{};
    light[0] = Vec3(4 + std::sin(p.x), 5 + std::cos(p.y), 3 + std::sin(p.z));
    for (size_t k = 1; k < kHarmonics; ++k) light[k] = Vec3(0.2f * std::sin(p.x * static_cast<float>(k)));
    ProbeField& f = out.field;
    f.place.push_back(p);
    f.state.push_back(ProbeState::kActive);
    f.validity.push_back(1);
    f.light.push_back(light);
    f.error.push_back({});
    f.irradiance_error.push_back(0.01f);
    f.samples.push_back(64);
    for (uint32_t t = 0; t < kIrradianceTexels; ++t)
      f.irradiance.push_back(harmonic_irradiance(
          light, octahedral_texel(t % kIrradianceSide, t / kIrradianceSide, kIrradianceSide)));
    for (uint32_t t = 0; t < kDistanceTexels; ++t) f.distance.emplace_back(t, t * t);
  }
  return out;
}

// The part of a KTX2 file that a volume has, by the specification alone (KTX 2.0, section 3).
struct PlainKtx2 {
  uint32_t words[9];
  uint64_t offset, bytes;
  const Bytes& file;
  explicit PlainKtx2(const Bytes& f) : file(f) {
    std::memcpy(words, f.data() + 12, sizeof words);
    std::memcpy(&offset, f.data() + 80, 8);
    std::memcpy(&bytes, f.data() + 88, 8);
  }
  // E5B9G9R9: three mantissas of 9 bits with one exponent, bias 15 and 9.
  Vec3 texel(uint32_t x, uint32_t y, uint32_t z) const {
    uint32_t bits;
    std::memcpy(&bits, file.data() + offset + 4 * (x + words[2] * (y + size_t{words[3]} * z)), 4);
    const float scale = std::ldexp(1.0f, static_cast<int>(bits >> 27) - 24);
    return Vec3(static_cast<float>(bits & 511), static_cast<float>(bits >> 9 & 511),
                static_cast<float>(bits >> 18 & 511)) *
           scale;
  }
};

// Read back without this program's code, by the lookup of Bevy's shader: a surface at a probe that faces
// along an axis gets the probe's E / pi, and others what is between.
TEST(ProbeFiles, BevysVolumeHasWhatItsShaderReads) {
  const Baked b = baked();
  const TempDir dir;
  ASSERT_TRUE(write_probe_files(std::span(&b.volume, 1), b.field, {true}, dir.path()));
  const auto bytes = read_file(dir.path() / "probes_bevy.ktx2");
  ASSERT_TRUE(bytes);
  const PlainKtx2 file(*bytes);
  constexpr uint32_t kE5b9g9r9 = 123;
  const UVec3 voxels = b.volume.roots * b.volume.root_size() + UVec3(1);
  EXPECT_EQ(file.words[0], kE5b9g9r9);
  EXPECT_EQ(file.words[2], voxels.x);
  EXPECT_EQ(file.words[3], 2 * voxels.y);
  EXPECT_EQ(file.words[4], 3 * voxels.z);
  EXPECT_EQ(file.words[5], 0u);  // layers
  EXPECT_EQ(file.bytes, uint64_t{24} * voxels.x * voxels.y * voxels.z);
  for (uint32_t i = 0; i < 200; ++i) {
    const UVec3 v(i * 7 % voxels.x, i * 3 % voxels.y, i * 5 % voxels.z);
    for (int axis = 0; axis < 3; ++axis)
      for (const bool negative : {false, true}) {
        // neg_offset of the shader: half of the texture's height, where N < 0.
        const Vec3 texel =
            file.texel(v.x, v.y + (negative ? voxels.y : 0), v.z + static_cast<uint32_t>(axis) * voxels.z);
        Vec3 n(0.0f);
        n[axis] = negative ? -1.0f : 1.0f;
        const Vec3 e = harmonic_irradiance(harmonics_in_air(b.volume, b.field, DVec3(v)), n) * kInvPi;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(texel[c], e[c], max_component(e) / 512) << i;
      }
  }
  // Between the voxels, against the query of C++. Beside coarser bricks the probes of both do not agree about
  // what is between them, and the texture has one of the two.
  size_t compared = 0;
  const auto volume = bevy_volume(b.volume, b.field);
  ASSERT_TRUE(volume);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(0.1f + 0.013f * static_cast<float>(i), 0.2f + 0.007f * static_cast<float>(i),
                 0.3f + 0.011f * static_cast<float>(i));
    const DVec3 at = (DVec3(p) - b.volume.low) / b.volume.spacing;
    const ProbeBrick& brick = b.volume.bricks[find_brick(b.volume, at)];
    if (brick.level > 0 || brick.coarser) continue;
    ++compared;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 n(0.0f);
      n[axis] = i % 2 ? -1.0f : 1.0f;
      const Vec3 e = harmonic_irradiance(harmonics_in_air(b.volume, b.field, at), n) * kInvPi;
      const Vec3 found = bevy_lookup(*volume, p, n);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], e[c], max_component(e) / 255) << i;
    }
  }
  EXPECT_GT(compared, 20u);
}

// Texel (x, y) of a texture that was written.
template <class T>
std::vector<T> texel_of(const TextureImages& t, size_t x, size_t y) {
  std::vector<T> out(texture_format(t.format).bytes / sizeof(T));
  std::memcpy(out.data(), &t.levels[0][0][texture_format(t.format).bytes * (y * t.width + x)],
              texture_format(t.format).bytes);
  return out;
}

TEST(ProbeFiles, TexturesHoldWhatTheShaderReads) {
  const Baked b = baked();
  const TempDir dir;
  ASSERT_TRUE(write_probe_files(std::span(&b.volume, 1), b.field, {.textures = true}, dir.path()));
  const auto read = [&](const char* name) {
    const auto bytes = read_file(dir.path() / name);
    EXPECT_TRUE(bytes) << name;
    return read_ktx2(*bytes);
  };
  const auto light = read("probes_light.ktx2"), irradiance = read("probes_irradiance.ktx2"),
             distance = read("probes_distance.ktx2");
  ASSERT_TRUE(light && irradiance && distance);
  const auto rows = static_cast<uint32_t>((b.field.size() + 63) / 64);
  EXPECT_EQ(light->width, 640u);
  EXPECT_EQ(light->height, rows);
  EXPECT_EQ(irradiance->height, 10 * rows);
  EXPECT_EQ(distance->width, 64u * 18);
  for (size_t i = 0; i < b.field.size(); i += 7) {
    const Vec3& p = b.field.place[i];
    EXPECT_EQ(texel_of<float>(*light, i % 64 * 10, i / 64), (std::vector{p.x, p.y, p.z, 0.0f}));
    const Vec3& xy = b.field.light[i][4];
    EXPECT_EQ(texel_of<float>(*light, i % 64 * 10 + 5, i / 64), (std::vector{xy.x, xy.y, xy.z, 0.0f}));
    float e[3];
    from_rgb9e5(texel_of<uint32_t>(*irradiance, i % 64 * 10 + 2, i / 64 * 10 + 3)[0], e);
    const Vec3& expected = b.field.irradiance[i * kIrradianceTexels + 17];
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(e[c], expected[c], max_component(expected) / 512);
    // The border above the first row is that row, mirrored; below 2048 halves hold whole numbers.
    const auto border = texel_of<uint16_t>(*distance, i % 64 * 18 + 1, i / 64 * 18);
    EXPECT_EQ(from_half(border[0]), static_cast<float>(kDistanceSide - 1));
    EXPECT_EQ(from_half(texel_of<uint16_t>(*distance, i % 64 * 18 + 3, i / 64 * 18 + 2)[0]), 18.0f);
    EXPECT_EQ(from_half(texel_of<uint16_t>(*distance, i % 64 * 18 + 3, i / 64 * 18 + 2)[1]), 324.0f);
  }
}

// The master's 64 tiles a row would make a texture of 16,398 rows of these: it is as wide as it may be
// instead.
TEST(ProbeFiles, TexturesOfManyProbesAreNoHigherThanTheyMayBe) {
  const size_t count = size_t{64} * 910 + 1;
  ProbeField f;
  f.place.resize(count);
  f.state.resize(count);
  f.light.resize(count);
  f.irradiance.resize(count * kIrradianceTexels);
  f.distance.resize(count * kDistanceTexels);
  f.distance[(count - 1) * kDistanceTexels] = Vec2(3, 10);
  const ProbeTextures t = probe_textures(f);
  for (const TextureImages* image : {&t.light, &t.irradiance, &t.distance}) {
    EXPECT_LE(image->width, kTextureSide);
    EXPECT_LE(image->height, kTextureSide);
  }
  EXPECT_EQ(t.irradiance.width, 640u);  // 9,110 rows
  EXPECT_EQ(t.distance.width, 910u * 18);
  EXPECT_EQ(t.distance.height, 65u * 18);
  // The last probe: the first of the row of tiles after 64 of them.
  const auto first = texel_of<uint16_t>(t.distance, 1, 64 * 18 + 1);
  EXPECT_EQ(from_half(first[0]), 3.0f);
  EXPECT_EQ(from_half(first[1]), 10.0f);
}

TEST(ProbeFiles, MastersHoldTheFieldAndItsBorders) {
  const Baked b = baked();
  const TempDir dir;
  ASSERT_TRUE(write_probe_files(std::span(&b.volume, 1), b.field, {}, dir.path()));
  const auto master = read_exr(dir.path() / "probes.exr");
  const auto maps = read_exr(dir.path() / "probes_irradiance.exr"),
             distances = read_exr(dir.path() / "probes_distance.exr");
  ASSERT_TRUE(master && maps && distances);
  for (size_t i = 0; i < b.field.size(); i += 13) {
    EXPECT_EQ(master->plane("position.Z")[i], b.field.place[i].z);
    EXPECT_EQ(master->plane("L2m1.G")[i], b.field.light[i][5].y);
    constexpr uint32_t kTile = kIrradianceSide + 2;
    const size_t corner = (i / kProbeColumns * kTile) * maps->width + i % kProbeColumns * kTile;
    EXPECT_EQ(maps->plane("R")[corner + 3 * maps->width + 2],
              b.field.irradiance[i * kIrradianceTexels + 17].x);
    EXPECT_EQ(maps->plane("B")[corner], b.field.irradiance[i * kIrradianceTexels + 63].z);  // the far corner
    constexpr uint32_t kWide = kDistanceSide + 2;
    const size_t first = (i / kProbeColumns * kWide) * distances->width + i % kProbeColumns * kWide;
    EXPECT_EQ(distances->plane("square")[first + distances->width + 2], 1.0f);
    // Above the first row lies the first row, mirrored.
    EXPECT_EQ(distances->plane("mean")[first + 1], static_cast<float>(kDistanceSide - 1));
  }
}

// The loader for three.js, in node, against the query of C++.
TEST(ProbeFiles, TheLoaderOfThreeLightsAsTheQueryDoes) {
  if (const auto why = no_node_tools(false)) GTEST_SKIP() << *why;
  Baked b = baked();
  for (size_t i = 0; i < b.field.size(); ++i) {
    if (i % 9 == 0) b.field.state[i] = ProbeState::kInactive;
    for (uint32_t t = 0; t < kDistanceTexels; ++t) {
      const float mean = 0.2f + 0.004f * static_cast<float>((7 * i + t) % 256);
      b.field.distance[i * kDistanceTexels + t] = Vec2(mean, 1.05f * mean * mean);
    }
  }
  b.volume.visibility = true;
  const TempDir dir;
  ASSERT_TRUE(write_probe_files(std::span(&b.volume, 1), b.field, {}, dir.path()));
  std::vector<float> points;
  for (int i = 0; i < 500; ++i)
    for (int k = 0; k < 3; ++k)
      points.push_back(-0.7f + 0.017f * static_cast<float>((i * (3 + 5 * k) + 11 * k) % 500));
  ASSERT_TRUE(write_file_atomic(dir.path() / "points", bytes_of(points)));
  const auto ran = run_command(node_script("probe_loader.mjs") + " '" + dir.path().string() + "'");
  ASSERT_EQ(ran.exit_status, 0) << ran.output;
  const auto bytes = read_file(dir.path() / "light");
  ASSERT_TRUE(bytes);
  ASSERT_EQ(bytes->size(), 4 * 28 * points.size() / 3);
  std::vector<float> light(bytes->size() / 4);
  std::memcpy(light.data(), bytes->data(), bytes->size());
  size_t lit = 0;
  for (size_t i = 0; i < points.size() / 3; ++i) {
    const Vec3 p(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    const Harmonics h = query_harmonics(b.volume, b.field, p);
    const float inside = query_weights(b.volume, b.field, p, std::nullopt).inside;
    EXPECT_NEAR(light[28 * i + 27], inside, 1e-5f) << i;
    if (inside == 0) continue;
    ++lit;
    for (size_t k = 0; k < kHarmonics; ++k)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(light[28 * i + 3 * k + static_cast<size_t>(c)], h[k][c], 1e-3f * h[0].x) << i << " " << k;
  }
  EXPECT_GT(lit, 200u);
}

}  // namespace
}  // namespace kiln::test

// docs/shaders/kiln_probes.glsl gives what common/probes/query.h gives, and Bevy's lookup of the exported
// file what the probes hold.
#include <cstring>
#include <random>

#include "common/base/files.h"
#include "common/probes/octahedral.h"
#include "coordinator/output/probes/bevy.h"
#include "tests/analytic/scene_maker.h"
#include "tests/probes/in_process_probes.h"
#include "tests/probes/two_rooms.h"
#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace {

struct Record {
  float position[4], normal[4];
};

template <class T>
void append(std::vector<T>& out, std::initializer_list<T> values) {
  out.insert(out.end(), values);
}

// The textures of the shader, as its head describes them.
void write_textures(const std::filesystem::path& folder, const ProbeVolume& v, const ProbeField& f) {
  std::vector<uint32_t> bricks;
  for (const ProbeBrick& b : v.bricks) {
    append(bricks, {b.corner.x, b.corner.y, b.corner.z, b.level, b.parent, b.children, b.coarser, 0u});
    bricks.insert(bricks.end(), b.probes.begin(), b.probes.end());
  }
  std::vector<float> light, distances;
  for (size_t i = 0; i < f.size(); ++i) {
    append(light, {f.place[i].x, f.place[i].y, f.place[i].z, static_cast<float>(f.state[i])});
    for (const Vec3& c : f.light[i]) append(light, {c.x, c.y, c.z, 0.0f});
    for (uint32_t y = 0; y < kDistanceSide + 2; ++y)
      for (uint32_t x = 0; x < kDistanceSide + 2; ++x) {
        uint32_t a = x, b = y;
        octahedral_inside(kDistanceSide, a, b);
        const Vec2& m = f.distance[i * kDistanceTexels + b * kDistanceSide + a];
        append(distances, {m.x, m.y});
      }
  }
  ASSERT_TRUE(write_file_atomic(folder / "bricks", bytes_of(bricks)));
  ASSERT_TRUE(write_file_atomic(folder / "light", bytes_of(light)));
  ASSERT_TRUE(write_file_atomic(folder / "distances", bytes_of(distances)));
}

TEST(ProbeShader, GivesWhatTheQueryGives) {
  if (const auto why = no_node_tools(true)) GTEST_SKIP() << *why;
  const Scene scene = two_rooms(0.2f);
  ProbeBox box;
  box.name = "rooms";
  box.spacing = 0.5;
  box.max_spacing = 1;
  box.visibility = true;
  box.low = DVec3(0.25);
  box.high = DVec3(8.2, 3, 8);
  const auto layout = lay_out_probes(scene, {box}, {});
  ASSERT_TRUE(layout) << layout.error().message;
  ProbeField field = bake_layout(scene, *layout, 64, true);
  // Light of every degree, in all colours.
  std::mt19937 random(3);
  std::normal_distribution<float> gauss;
  for (Harmonics& h : field.light)
    for (size_t k = 1; k < kHarmonics; ++k)
      h[k] += 0.3f * h[0] * Vec3(gauss(random), gauss(random), gauss(random));
  const ProbeVolume& v = layout->volumes.front();
  EXPECT_EQ(v.levels, 2u);
  const TempDir dir;
  write_textures(dir.path(), v, field);
  const auto bevy = bevy_volume(v, field);
  ASSERT_TRUE(bevy);
  Bytes voxels;
  for (const Bytes& slice : bevy->texture.levels[0]) voxels.insert(voxels.end(), slice.begin(), slice.end());
  ASSERT_TRUE(write_file_atomic(dir.path() / "bevy", voxels));

  std::vector<Record> records;
  std::uniform_real_distribution<float> number(-0.5f, 1.0f);
  for (int i = 0; i < 3000; ++i) {
    Record r{};
    Vec3 n(gauss(random), gauss(random), gauss(random));
    n = normalize_or(n, Vec3(0, 1, 0));
    for (int k = 0; k < 3; ++k) {
      r.position[k] = number(random) * static_cast<float>(v.high()[k]);
      r.normal[k] = n[k];
    }
    records.push_back(r);
  }
  ASSERT_TRUE(write_file_atomic(dir.path() / "records", bytes_of(records)));
  std::ostringstream facts;
  facts << "bricks " << v.bricks.size() << " probes " << field.size() << " records " << records.size()
        << " levels " << v.levels << " roots " << v.roots.x << " " << v.roots.y << " " << v.roots.z << " low "
        << v.low.x << " " << v.low.y << " " << v.low.z << " spacing " << v.spacing << " visibility 1 size "
        << bevy->texture.width << " " << bevy->texture.height << " " << bevy->texture.layers()
        << " translation " << bevy->centre.x << " " << bevy->centre.y << " " << bevy->centre.z << " scale "
        << bevy->size.x << " " << bevy->size.y << " " << bevy->size.z;
  ASSERT_TRUE(write_file_atomic(dir.path() / "probes.txt", bytes_of(std::string_view(facts.str()))));
  const auto ran = run_command(node_script("probes.mjs") + " '" +
                               (source_dir() / "docs/shaders/kiln_probes.glsl").string() + "' '" +
                               dir.path().string() + "'");
  ASSERT_EQ(ran.exit_status, 0) << ran.output;
  const Bytes bytes = *read_file(dir.path() / "out");
  std::vector<float> out(bytes.size() / 4);
  std::memcpy(out.data(), bytes.data(), bytes.size());
  ASSERT_EQ(out.size(), 8 * records.size());
  size_t inside = 0;
  for (size_t i = 0; i < records.size(); ++i) {
    const Record& r = records[i];
    const Vec3 p(r.position[0], r.position[1], r.position[2]), n(r.normal[0], r.normal[1], r.normal[2]);
    const ProbeLight light = query_volume(v, field, p, n);
    const float* const o = &out[4 * i];
    EXPECT_NEAR(o[3], light.weight, 1e-4f) << i;
    // Places in single precision are 10^-6 of a cell off, and Chebyshev's bound is as steep as 1 in a few
    // hundredths of a cell where distances vary little.
    const float scale = max_component(light.irradiance);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(o[c], light.irradiance[c], 1e-3f * scale + 1e-5f) << i;
    inside += light.weight == 1;
    const float* const b = &out[4 * (records.size() + i)];
    const Vec3 found = bevy_lookup(*bevy, p, n);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[c], found[c], max_component(found) / 255 + 1e-5f) << i;
  }
  EXPECT_GT(inside, 500u);
}

}  // namespace
}  // namespace kiln::test

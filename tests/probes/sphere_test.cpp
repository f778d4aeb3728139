// A sphere that moves through a room, as three.js shows it with docs/examples/three/kiln_probes.js, against
// the query of C++ at the same places.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/base/files.h"
#include "common/base/json.h"
#include "common/image/image.h"
#include "common/probes/query.h"
#include "coordinator/output/probes/probe_files.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/analytic/scene_maker.h"
#include "tests/probes/in_process_probes.h"
#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace {

constexpr uint32_t kWidth = 768, kHeight = 512;  // of a room of 3 x 2 m, seen from +z
constexpr float kWide = 3, kHigh = 2, kRadius = 0.16f;
constexpr float kInner = 0.97f;  // of the radius; beyond, triangles and the sphere differ
constexpr int kPlaces = 8;

// A wall of 10 cm parts the room up to a passage in front; a lamp and a panel shine on its left.
Scene parted_room() {
  SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.7f, 0.6f, 0.5f));
  const uint32_t panel = m.lambert(Vec3(0.2f), Vec3(6.0f, 5.0f, 3.0f));
  m.box({0, 0, 0}, {3, 2, 4}, true, wall);
  m.box({1.45f, 0, 0}, {1.55f, 2, 3}, false, wall);
  m.quad({0.4f, 1.9f, 2}, {0.8f, 0, 0}, {0, 0, 0.5f}, panel);
  m.point({0.5f, 1.2f, 3.3f}, Vec3(1, 2, 3));
  return m.take();
}

Vec3 place_of(int i) {
  const auto t = static_cast<float>(i);
  return Vec3(0.25f + 0.355f * t, 1.0f + 0.6f * std::sin(1.1f * t), 3.5f - 0.4f * t);
}

// The unit normal of a ball's point under a pixel, rows from the bottom; none: beside the balls.
struct Seen {
  int place = -1;
  Vec3 normal{0.0f};
};
Seen seen_at(uint32_t x, uint32_t row) {
  const Vec2 at((static_cast<float>(x) + 0.5f) * kWide / kWidth,
                (static_cast<float>(row) + 0.5f) * kHigh / kHeight);
  for (int i = 0; i < kPlaces; ++i) {
    const Vec3 centre = place_of(i);
    const Vec2 d = (at - Vec2(centre.x, centre.y)) / kRadius;
    const float square = d.x * d.x + d.y * d.y;
    if (square < kInner * kInner) return {i, Vec3(d.x, d.y, std::sqrt(1 - square))};
  }
  return {};
}

void write_scene(const Scene& scene, float colour, const std::filesystem::path& path) {
  JsonWriter w;
  w.begin_object().pair("width", kWidth).pair("height", kHeight).pair("wide", double{kWide});
  w.pair("high", double{kHigh}).pair("radius", double{kRadius}).pair("colour", double{colour});
  const auto vector = [&](const Vec3& v) {
    for (int k = 0; k < 3; ++k) w.value(double{v[k]});
  };
  w.key("places").begin_array();
  for (int i = 0; i < kPlaces; ++i) {
    w.begin_array();
    vector(place_of(i));
    w.end_array();
  }
  w.end_array().key("corners").begin_array();
  for (const Instance& in : scene.instances) {
    const Mesh& mesh = scene.meshes[in.mesh];
    for (const auto& t : mesh.triangles)
      for (int c = 0; c < 3; ++c) vector(transform_point(in.to_world, mesh.positions[t[c]]));
  }
  ASSERT_TRUE(write_file_atomic(path, bytes_of(w.end_array().end_object().take())));
}

TEST(ProbeSphere, ThreeShowsWhatTheQueryGives) {
  if (const auto why = no_node_tools(true)) GTEST_SKIP() << *why;
  const Scene scene = parted_room();
  ProbeBox box;
  box.name = "room";
  box.low = DVec3(0.1);
  box.high = DVec3(2.9, 1.9, 3.9);
  box.spacing = 0.4;
  box.max_spacing = 0.8;
  box.visibility = true;
  const auto layout = lay_out_probes(scene, {box}, {});
  ASSERT_TRUE(layout) << layout.error().message;
  const ProbeVolume& volume = layout->volumes.front();
  const ProbeField field = bake_layout(scene, *layout, 128, true);
  std::vector<Harmonics> light;
  for (int i = 0; i < kPlaces; ++i) light.push_back(query_harmonics(volume, field, place_of(i)));
  float brightest = 0;
  for (uint32_t row = 0; row < kHeight; ++row)
    for (uint32_t x = 0; x < kWidth; ++x)
      if (const Seen s = seen_at(x, row); s.place >= 0)
        brightest = std::max(brightest, max_component(harmonic_irradiance(light[s.place], s.normal)));
  const float colour = 0.9f * kPi / brightest;

  const TempDir dir;
  ASSERT_TRUE(write_probe_files(std::span(&volume, 1), field, {}, dir.path()));
  write_scene(scene, colour, dir.path() / "scene.json");
  const auto ran = run_command(node_script("probe_sphere.mjs") + " '" + dir.path().string() + "'");
  ASSERT_EQ(ran.exit_status, 0) << ran.output;
  const Bytes pixels = *read_file(dir.path() / "pixels");
  ASSERT_EQ(pixels.size(), size_t{4} * kWidth * kHeight);
  const auto shown = [&](uint32_t x, uint32_t row, int c) {
    return static_cast<uint8_t>(pixels[4 * (size_t{row} * kWidth + x) + static_cast<size_t>(c)]);
  };
  size_t compared = 0;
  float worst = 0, darkest = 255;
  for (uint32_t row = 0; row < kHeight; ++row)
    for (uint32_t x = 0; x < kWidth; ++x) {
      const Seen s = seen_at(x, row);
      if (s.place < 0) continue;
      ++compared;
      const Vec3 e = harmonic_irradiance(light[s.place], s.normal) * (colour * kInvPi);
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(shown(x, row, c) - 255 * linear_to_srgb(e[c])));
        darkest = std::min(darkest, 255 * linear_to_srgb(e[c]));
      }
    }
  EXPECT_GT(compared, 30000u);
  EXPECT_LT(worst, 2);
  EXPECT_LT(darkest, 128);  // there is shade in the picture
  std::printf("%zu pixels, at most %.2f of 255 apart\n", compared, worst);
  std::vector<uint8_t> rgb;
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) rgb.push_back(shown(x, kHeight - 1 - y, c));
  ASSERT_TRUE(write_png(binary_dir() / "probe_sphere.png", kWidth, kHeight, rgb));
}

}  // namespace
}  // namespace kiln::test

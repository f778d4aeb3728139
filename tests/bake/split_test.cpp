// --split: both parts of E in files of their own.
#include "common/image/image.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

class Split : public testing::Test {
 protected:
  Split() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  BakeReport bake(const std::string& name, const std::function<void(BakeSettings&)>& change) {
    BakeRequest request;
    request.scene = dir_.path() / "room.glb";
    request.output = dir_.path() / name;
    request.worker_program = test::binary_dir() / "bin/kiln-worker";
    request.settings.layout = "pack";
    request.settings.texels_per_metre = 4;
    request.settings.workers = request.settings.threads = 1;
    request.settings.min_samples = request.settings.max_samples = 64;
    request.pictures = false;
    change(request.settings);
    const auto report = run_bake(request, [](const auto&) {});
    if (!report) throw std::runtime_error(report.error().message);
    return *report;
  }
  Planes read(const std::string& folder, const std::string& file) {
    const auto planes = read_exr(dir_.path() / folder / file);
    if (!planes) throw std::runtime_error(planes.error().message);
    return *planes;
  }

  test::TempDir dir_;
};

// The whole is the same, to the bit, as without the setting: filtered, joined and dilated alike.
TEST_F(Split, PartsAddUpToE) {
  bake("whole", [](BakeSettings&) {});
  bake("split", [](BakeSettings& s) { s.split = true; });
  const Planes whole = read("whole", "irradiance.exr"), e = read("split", "irradiance.exr"),
               direct = read("split", "irradiance.direct.exr"),
               indirect = read("split", "irradiance.indirect.exr");
  double sum_direct = 0, sum_indirect = 0;
  for (const char* channel : {"R", "G", "B"})
    for (size_t t = 0; t < e.plane(channel).size(); ++t) {
      const float all = e.plane(channel)[t], a = direct.plane(channel)[t], b = indirect.plane(channel)[t];
      ASSERT_EQ(all, whole.plane(channel)[t]) << channel << " " << t;
      ASSERT_GE(a, 0.0f);
      ASSERT_GE(b, 0.0f);
      ASSERT_NEAR(a + b, all, 0x1p-22 * all) << channel << " " << t;
      sum_direct += a;
      sum_indirect += b;
    }
  EXPECT_EQ(e.plane("A"), direct.plane("A"));
  EXPECT_EQ(e.plane("A"), indirect.plane("A"));
  EXPECT_GT(sum_direct, 0);
  EXPECT_GT(sum_indirect, 0);
  EXPECT_FALSE(std::filesystem::exists(dir_.path() / "whole/irradiance.direct.exr"));
}

// Without filters and seams the direct part is what a bake of direct light alone measures: of the same
// samples to the rounding of sums, and with caches, whose samples are others because some were dropped, to
// what is stated.
TEST_F(Split, DirectLightIsThatOfABakeOfDirectLight) {
  const auto plain = [](BakeSettings& s) { s.denoise = s.seams = s.cache = false; };
  bake("split", [&](BakeSettings& s) { plain(s), s.split = true; });
  bake("cached", [&](BakeSettings& s) { plain(s), s.split = s.cache = true; });
  bake("direct", [&](BakeSettings& s) { plain(s), s.indirect = false; });
  const Planes part = read("split", "irradiance.direct.exr"),
               cached = read("cached", "irradiance.direct.exr"), alone = read("direct", "irradiance.exr"),
               error = read("direct", "error.exr");
  for (const char* channel : {"R", "G", "B"})
    for (size_t t = 0; t < part.plane(channel).size(); ++t)
      ASSERT_NEAR(part.plane(channel)[t], alone.plane(channel)[t], 1e-5 * (1 + alone.plane(channel)[t]))
          << channel << " " << t;
  const auto light = [](const Planes& p, size_t t) {
    return double{luminance(Vec3(p.plane("R")[t], p.plane("G")[t], p.plane("B")[t]))};
  };
  double difference = 0, variance = 0;
  for (size_t t = 0; t < alone.plane("R").size(); ++t) {
    const double stated = error.plane("Y")[t];
    if (!(stated > 0)) continue;
    difference += light(cached, t) - light(alone, t);
    variance += 2 * stated * stated;
  }
  ASSERT_GT(variance, 0);
  EXPECT_LE(std::abs(difference), 4 * std::sqrt(variance));
}

}  // namespace
}  // namespace kiln

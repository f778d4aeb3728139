// Probes in the viewer, in headless Chromium: balls by state, the ball that is dragged and the slice against
// the query of C++, and that a bake without probes costs nothing.
#include <cstring>
#include <fstream>
#include <sstream>

#include "common/base/files.h"
#include "common/image/image.h"
#include "common/probes/query.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/viewer/view_server.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bake/scene_gltf.h"
#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

constexpr int kWidth = 720, kHeight = 420;
constexpr float kExposure = 2, kFov = 34;  // degrees, vertical
const Vec3 kEye(3, 1.25f, 10);
const std::string kLook =
    "?folder=/bake/&ratio=1&ui=off&antialias=off&curve=srgb&exposure=2&fov=34"
    "&eye=3,1.25,10&target=3,1.25,0";

// A wall of 20 cm parts a room of 6 x 2.5 x 4 m up to a passage in front; it is lit on its left.
Scene parted_room(bool metal = false) {
  SceneMaker m;
  const Vec3 colour(0.7f, 0.6f, 0.5f);
  const uint32_t wall = metal ? m.metallic_roughness(colour, 1, 1) : m.lambert(colour);
  const uint32_t panel = m.lambert(Vec3(0.2f), Vec3(9.0f, 7.5f, 5.0f));
  m.box({0, 0, 0}, {6, 2.5f, 4}, true, wall);
  m.box({2.9f, 0, 0}, {3.1f, 2.5f, 3}, false, wall);
  m.quad({0.8f, 2.4f, 1}, {1.2f, 0, 0}, {0, 0, 1.5f}, panel);
  m.point({0.5f, 1.2f, 3.3f}, Vec3(0.5f, 1, 1.5f));
  return m.take();
}

// The room as published, and read back as the query wants it.
struct Bake {
  ProbeVolume volume;
  ProbeField field;
  float light(const Vec3& at, int c, bool visibility) const {  // mean E
    ProbeQuery query;
    query.visibility = visibility;
    return 0.8862269255f * query_harmonics(volume, field, at, query)[0][c];
  }
};

ProbeField read_field(const fs::path& folder, size_t count) {
  const auto master = read_exr(folder / "probes.exr"), distances = read_exr(folder / "probes_distance.exr");
  ProbeField f;
  for (size_t i = 0; i < count; ++i) {
    f.place.emplace_back(master->plane("position.X")[i], master->plane("position.Y")[i],
                         master->plane("position.Z")[i]);
    f.state.push_back(static_cast<ProbeState>(static_cast<int>(master->plane("state")[i])));
    Harmonics h;
    for (size_t k = 0; k < kHarmonics; ++k)
      for (int c = 0; c < 3; ++c) h[k][c] = master->plane(std::string(kHarmonicNames[k]) + "." + "RGB"[c])[i];
    f.light.push_back(h);
    constexpr uint32_t kTile = kDistanceSide + 2;
    for (uint32_t t = 0; t < kDistanceTexels; ++t) {
      const size_t x = i % 64 * kTile + 1 + t % kDistanceSide, y = i / 64 * kTile + 1 + t / kDistanceSide;
      f.distance.emplace_back(distances->plane("mean")[y * distances->width + x],
                              distances->plane("square")[y * distances->width + x]);
    }
  }
  return f;
}

class ProbeView : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = no_node_tools(true)) GTEST_SKIP() << *why;
    pictures_ = binary_dir() / "probe_view_test";
    fs::create_directories(pictures_);
    write_scene_glb(parted_room(), dir_.path() / "room.glb");
  }

  BakeRequest request(const std::string& quantities, const std::string& volume) {
    BakeRequest r;
    r.scene = dir_.path() / "room.glb";
    r.output = dir_.path() / "out";
    r.worker_program = binary_dir() / "bin/kiln-worker";
    std::ofstream(dir_.path() / "v.json") << R"({"version":1,"volumes":[)" << volume << "]}";
    const auto set = [&](const char* name, const std::string& value) {
      EXPECT_TRUE(set_option(r.settings, name, value, "test")) << name;
    };
    set("quantities", quantities);
    if (!volume.empty()) set("probes", (dir_.path() / "v.json").string());
    for (const char* name : {"min-samples", "max-samples"}) set(name, "64");
    set("texels-per-metre", "2");
    set("encode", "none");
    for (const char* name : {"workers", "threads"}) set(name, "1");
    r.pictures = false;
    return r;
  }

  // What the page says, line by line, after the steps of probe_view.mjs.
  std::vector<std::string> use(const BakeRequest& r, const std::string& query, const std::string& steps) {
    const auto server = ViewServer::start({r.output, source_dir() / "docs", 0});
    EXPECT_TRUE(server);
    if (!server) return {};
    const auto ran = run_command(
        node_script("probe_view.mjs") + " 'http://127.0.0.1:" + std::to_string((*server)->port()) +
        "/docs/examples/three/index.html" + kLook + query + "' " + std::to_string(kWidth) + " " +
        std::to_string(kHeight) + " '" + pictures_.string() + "' " + steps);
    EXPECT_EQ(ran.exit_status, 0) << ran.output;
    std::vector<std::string> lines;
    std::istringstream in(ran.output);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  Texture picture(const std::string& name) {
    const auto bytes = read_file(pictures_ / (name + ".png"));
    EXPECT_TRUE(bytes) << name;
    return *decode_image(*bytes, name);
  }

  TempDir dir_;
  fs::path pictures_;
};

int at(const Texture& t, int x, int y, int c) {
  return static_cast<int>(t.texels[(static_cast<size_t>(y) * t.width + static_cast<size_t>(x)) * t.channels +
                                   static_cast<size_t>(c)]);
}

size_t magenta(const Texture& t) {
  size_t count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      count += at(t, x, y, 0) > 140 && at(t, x, y, 2) > 140 && at(t, x, y, 1) < 40;
  return count;
}

// Through the centre of a pixel; z is -1.
Vec3 ray_of(int x, int y) {
  const float t = std::tan(0.5f * kFov * kPi / 180);
  return Vec3((2 * (static_cast<float>(x) + 0.5f) / kWidth - 1) * t * kWidth / kHeight,
              (1 - 2 * (static_cast<float>(y) + 0.5f) / kHeight) * t, -1);
}
Vec2 pixel_of(const Vec3& p) {
  const Vec3 d = p - kEye;
  const float t = std::tan(0.5f * kFov * kPi / 180);
  return Vec2((d.x / -d.z / (t * kWidth / kHeight) + 1) * 0.5f * kWidth,
              (1 - d.y / -d.z / t) * 0.5f * kHeight);
}

float shown(float e) {  // on a grey of 0.5
  return 255 * linear_to_srgb(std::min(1.0f, 0.5f * kInvPi * kExposure * e));
}

struct Compared {
  size_t pixels = 0, beyond = 0;
  float worst = 0;
};

// Of the ball at `centre`, up to 0.97 of its radius.
Compared compare_ball(const Texture& t, const Bake& bake, const Vec3& centre, float radius) {
  Compared out;
  const Harmonics light = query_harmonics(bake.volume, bake.field, centre);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec3 d = ray_of(x, y), to = centre - kEye;
      const float along = dot(to, d) / dot(d, d);
      const float off = length(to - d * along), half = radius * radius - off * off;
      if (off > 0.97f * radius) continue;
      const Vec3 n = (d * (along - std::sqrt(half / dot(d, d))) - to) / radius;
      const Vec3 e = harmonic_irradiance(light, n);
      ++out.pixels;
      for (int c = 0; c < 3; ++c) {
        out.worst = std::max(out.worst, std::abs(static_cast<float>(at(t, x, y, c)) - shown(e[c])));
      }
    }
  return out;
}

// By how much visibility changes light, as the slice shows it: 1 where all of it leaks in.
float leak(const Bake& bake, const Vec3& p) {
  const auto luminance_of = [&](bool visibility) {
    return luminance(
        Vec3(bake.light(p, 0, visibility), bake.light(p, 1, visibility), bake.light(p, 2, visibility)));
  };
  const float with = luminance_of(true), without = luminance_of(false);
  return (without - with) / std::max({with, without, 0.02f * 2 * kPi / kExposure});
}

struct Slices {
  Compared seen, blind;
  size_t leaks = 0, hides = 0, same = 0, wrong = 0;
};

// A slice across z, inside the room and 8 cm off where walls are drawn.
Slices compare_slices(const Texture& seen, const Texture& blind, const Texture& leaks, const Bake& bake,
                      float z) {
  Slices out;
  const auto add = [](Compared& to, const Texture& t, int x, int y, int c, float e) {
    const float off = std::abs(static_cast<float>(at(t, x, y, c)) - shown(e));
    to.worst = std::max(to.worst, off);
    to.beyond += off > 2;
    ++to.pixels;
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec3 p = kEye + ray_of(x, y) * (kEye.z - z);
      const float high[] = {p.y - 0.3f, 2.5f - p.y, p.x - 0.4f, 6 - p.x, std::abs(p.x - 3) - 0.1f};
      if (*std::min_element(std::begin(high), std::end(high)) < 0.08f) continue;
      for (int c = 0; c < 3; ++c) {
        add(out.seen, seen, x, y, c, bake.light(p, c, true));
        add(out.blind, blind, x, y, c, bake.light(p, c, false));
      }
      const float d = leak(bake, p);
      const int red = at(leaks, x, y, 0), green = at(leaks, x, y, 1), blue = at(leaks, x, y, 2);
      if (d > 0.3f) {
        ++out.leaks;
        out.wrong += red < blue + 40;
      } else if (d < -0.3f) {
        ++out.hides;
        out.wrong += blue < red + 40;
      } else if (std::abs(d) < 0.01f) {
        ++out.same;
        out.wrong += std::max({std::abs(red - 43), std::abs(green - 43), std::abs(blue - 43)}) > 8;
      }
    }
  return out;
}

Vec3 ball_of(const std::string& line) {
  Vec3 p(0.0f);
  std::istringstream in(line.substr(line.rfind('|') + 1));
  in >> p.x >> p.y >> p.z;
  return p;
}

constexpr const char* kWhole =
    R"({"name":"room","min":[0.4,0.3,0.4],"max":[5.8,2.3,3.7],"spacing":0.8,"visibility":true})";

TEST_F(ProbeView, OfABakeOfProbesAlone) {
  const BakeRequest r = request("probes", kWhole);
  ASSERT_TRUE(run_bake(r, [](const BakeProgress&) {}));
  std::vector<StageTime> times;
  const auto pre = run_preflight(r.scene, r.settings, times, [](const BakeProgress&) {});
  ASSERT_TRUE(pre && pre->probes);
  const Bake bake{pre->probes->volumes.front(), read_field(r.output, pre->probes->size())};
  ASSERT_GT(pre->probes->size(), pre->probes->active());
  const Vec3 start(1.2f, 1.2f, 2.0f);
  const Vec2 from = pixel_of(start), to = pixel_of({3.38f, 0.9f, 2.0f});
  std::ostringstream drag;
  drag << "drag:" << from.x << "," << from.y << "," << to.x << "," << to.y;
  const auto said =
      use(r, "&ball=1.2,1.2,2",
          "shot:ball " + drag.str() +
              " shot:dragged key:b key:p key:p shot:probes key:i shot:active key:p key:c key:c key:c "
              "shot:slice key:v shot:blind key:v shot:leaks");
  ASSERT_EQ(said.size(), 20u);
  EXPECT_EQ(said.front(), "panel true");

  // The ball, where the query puts it and where the mouse does.
  const float radius = 0.2f;
  const Vec3 dragged = ball_of(said[2]);
  EXPECT_NEAR(dragged.x, 3.38f, 0.02f);
  EXPECT_NEAR(dragged.y, 0.9f, 0.02f);
  EXPECT_NEAR(dragged.z, 2.0f, 1e-4f);  // at its distance from the camera's plane
  for (const auto& [name, centre] : {std::pair{"ball", start}, std::pair{"dragged", dragged}}) {
    const Compared c = compare_ball(picture(name), bake, centre, radius);
    std::printf("%s: %zu pixels, at most %.2f of 255 apart\n", name, c.pixels, c.worst);
    EXPECT_GT(c.pixels, 300u);
    EXPECT_LT(c.worst, 2) << name;
  }
  // Light of the other side of the wall would be far brighter.
  EXPECT_GT(bake.light(dragged, 1, false), 2 * bake.light(dragged, 1, true));
  EXPECT_GT(magenta(picture("probes")), 50u);
  EXPECT_EQ(magenta(picture("active")), 0u);
  EXPECT_EQ(magenta(picture("ball")), 0u);

  EXPECT_EQ(said[14].substr(0, 25), "shot:slice | off z light ");
  const Slices s = compare_slices(picture("slice"), picture("blind"), picture("leaks"), bake,
                                  static_cast<float>(bake.volume.low.z));
  std::printf(
      "slice: %zu values, %zu beyond 2 of 255; without visibility %zu beyond; leaks %zu, hides %zu, same "
      "%zu, wrong %zu\n",
      s.seen.pixels, s.seen.beyond, s.blind.beyond, s.leaks, s.hides, s.same, s.wrong);
  EXPECT_GT(s.seen.pixels, 60000u);
  EXPECT_LE(s.seen.beyond, s.seen.pixels / 1000);
  EXPECT_LE(s.blind.beyond, s.blind.pixels / 1000);
  EXPECT_GT(s.leaks, 500u);
  EXPECT_GT(s.same, 500u);
  EXPECT_LE(s.wrong, (s.leaks + s.hides + s.same) / 1000);
}

// Beside a map, of a volume in the lit half of the room: no probe is inside geometry, and without
// visibility there is nothing to compare slices with.
// A material that says nothing is metal in glTF: its light is mirrored, and without a map it is that of
// probes.
TEST_F(ProbeView, MetalIsLitByTheProbesAlone) {
  write_scene_glb(parted_room(true), dir_.path() / "room.glb");
  const BakeRequest r = request("probes", R"({"min":[0.1,0.1,0.1],"max":[5.9,2.4,3.9],"spacing":0.5})");
  ASSERT_TRUE(run_bake(r, [](const BakeProgress&) {}));
  use(r, "", "shot:metal");
  const Texture t = picture("metal");
  size_t lit = 0, seen = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = kWidth / 4; x < kWidth * 2 / 5; ++x) {  // the lit side's back wall
      if (y < kHeight / 3 || y > kHeight * 2 / 3) continue;
      ++seen;
      lit += at(t, x, y, 0) > 40 && at(t, x, y, 0) > at(t, x, y, 2);
    }
  EXPECT_GT(lit, seen * 9 / 10);
}

TEST_F(ProbeView, BesideAMap) {
  const BakeRequest r =
      request("light,probes", R"({"name":"half","min":[0.3,0.2,0.4],"max":[2.39,2.29,2.49],"spacing":0.7})");
  ASSERT_TRUE(run_bake(r, [](const BakeProgress&) {}));
  const auto said = use(r, "", "shot:none key:p key:p shot:half key:p key:c key:v key:c");
  ASSERT_EQ(said.size(), 10u);
  EXPECT_EQ(said[0], "panel true");
  EXPECT_EQ(said[1].substr(0, 23), "shot:none | not loaded ");
  EXPECT_EQ(said[4].substr(0, 28), "shot:half | through  light |");
  EXPECT_EQ(said[7].substr(0, 20), "key:v | off x light ");
  EXPECT_EQ(said[9].find("probes_distance"), std::string::npos) << said[9];
  const Texture none = picture("none"), half = picture("half");
  EXPECT_EQ(magenta(half), 0u);
  size_t changed = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) changed += at(none, x, y, 1) != at(half, x, y, 1);
  EXPECT_GT(changed, 500u);
}

TEST_F(ProbeView, ABakeWithoutProbesHasNothingOfThem) {
  const BakeRequest r = request("light", "");
  ASSERT_TRUE(run_bake(r, [](const BakeProgress&) {}));
  const auto said = use(r, "&probes=shown&ball=on", "key:p key:b key:c shot:plain");
  ASSERT_EQ(said.size(), 6u);
  EXPECT_EQ(said.front(), "panel false");
  EXPECT_EQ(said.back(), "fetched ");
}

}  // namespace
}  // namespace kiln::test

// The viewer's picture against our own renderer's, of the same published folder, camera, exposure and curve.
#include "common/atlas/atlas_lookup.h"
#include "common/base/files.h"
#include "coordinator/output/container/container.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/output/textures/texel_codec.h"
#include "coordinator/picture/raster.h"
#include "coordinator/report/preview.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/viewer/view_server.h"
#include "tests/viewer/node_tools.h"
#include "tests/viewer/published.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr uint32_t kWidth = 480, kHeight = 270;
constexpr float kExposure = 0.5f;

using test::Published;

// Pixels to compare: 0, or by how much of displayed steps the lookup itself may differ, plus 1.
//   Left out are pixels whose 3 x 3 neighbours do not all show one chart (silhouettes and creases: which
//   surface a pixel there shows is decided by its rasteriser's subpixels), surfaces whose alpha is tested,
//   and places with a texel that has no value: ours leaves such texels out of the bilinear mean, a texture
//   unit cannot.
class Comparable {
 public:
  Comparable(const Published& p, const ViewStyle& style)
      : p_(p), look_(p.imported.scene, p.atlas, p.map, style.textures), lookup_(p.atlas), style_(style) {
    view_ = rasterise(p.imported.scene, p.imported.cameras.front(), kWidth, kHeight,
                      [&](const Fragment& f) { return look_.visible(f); });
    anything_ = rasterise(p.imported.scene, p.imported.cameras.front(), kWidth, kHeight,
                          [&](const Fragment& f) { return !f.back || look_.double_sided(f.instance); });
  }

  bool pixel(uint32_t x, uint32_t y) const {
    if (x == 0 || y == 0 || x + 1 == kWidth || y + 1 == kHeight) return false;
    const uint32_t chart = chart_at(x, y);
    for (uint32_t k = 0; k < 9; ++k)
      if (chart == 0 || chart_at(x + k % 3 - 1, y + k / 3 - 1) != chart) return false;
    for (uint32_t k = 0; k < 9; ++k)
      if (is_seen_through(anything_.fragments[size_t{y + k / 3 - 1} * kWidth + x + k % 3 - 1])) return false;
    return all_set(fragment(x, y));
  }

  // Displayed steps that a lookup may differ by because texture units keep weights with 8 bits: half a step
  // of either weight, of the contrast of the four texels.
  double weight_slack(uint32_t x, uint32_t y) const {
    const Fragment& f = fragment(x, y);
    const Vec3 factor = Vec3(look_.base_color(f)) * (kInvPi * kExposure);
    double worst = 0;
    for (int c = 0; c < 3; ++c) {
      float low = 1e30f, high = 0;
      for_each_texel(f, [&](size_t t) {
        const float e = p_.map.planes.data[static_cast<size_t>(c)][t];
        low = std::min(low, e), high = std::max(high, e);
      });
      const float emission = look_.emission(f)[c] * kExposure;
      worst = std::max(worst, 255.0 * (linear_to_srgb(high * factor[c] + emission) -
                                       linear_to_srgb(low * factor[c] + emission)));
    }
    return worst * 2 / 512;
  }

 private:
  bool is_seen_through(const Fragment& f) const {
    const Record& material = p_.imported.scene.materials[p_.imported.scene.instances[f.instance].material];
    const Property* alpha = material.find("alpha_mode");
    return f.inverse_depth > 0 && ((alpha && alpha->word != "opaque") || material.find("transmission"));
  }
  const Fragment& fragment(uint32_t x, uint32_t y) const { return view_.fragments[size_t{y} * kWidth + x]; }
  AtlasPlace place_of(const Fragment& f) const { return lookup_.at(f.instance, f.triangle, f.b1, f.b2); }
  uint32_t chart_at(uint32_t x, uint32_t y) const {  // 0: none
    const Fragment& f = fragment(x, y);
    return f.inverse_depth == 0 ? 0 : place_of(f).placement + 1;
  }
  template <class Visit>
  void for_each_texel(const Fragment& f, const Visit& visit) const {
    const DVec2 c = place_of(f).texels - 0.5;
    for (int k = 0; k < 4; ++k) {
      const double x = std::clamp(std::floor(c.x) + (k & 1), 0.0, p_.atlas.width - 1.0);
      const double y = std::clamp(std::floor(c.y) + (k >> 1), 0.0, p_.atlas.height - 1.0);
      visit(static_cast<size_t>(y) * p_.atlas.width + static_cast<size_t>(x));
    }
  }
  bool all_set(const Fragment& f) const {
    bool set = true;
    for_each_texel(f, [&](size_t t) { set &= is_set(p_.map.validity[t]); });
    return set;
  }

  const Published& p_;
  SurfaceLook look_;
  AtlasLookup lookup_;
  ViewStyle style_;
  View view_, anything_;  // as shown; with what one sees through
};

struct Difference {
  size_t compared = 0, beyond = 0;
  double mean = 0, worst = 0;
};

// The tolerance of a pixel and channel, in steps of 255:
//   1      both round: two roundings of numbers that agree differ by at most one
//   1/16   of the contrast within the 3 x 3 pixels: a rasteriser keeps corners with at least 4 bits of
//   subpixel
//          (Vulkan's subPixelPrecisionBits), so its lookup may lie up to 1/16 pixel beside ours
//   weight_slack
Difference compare(const Picture& ours, const Texture& theirs, const Comparable& comparable) {
  Difference d;
  const auto our = [&](uint32_t x, uint32_t y, uint32_t c) {
    return static_cast<double>(ours.rgb[(size_t{y} * kWidth + x) * 3 + c]);
  };
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x) {
      if (!comparable.pixel(x, y)) continue;
      const double slack = comparable.weight_slack(x, y);
      bool within = true;
      for (uint32_t c = 0; c < 3; ++c) {
        double low = 255, high = 0;
        for (uint32_t k = 0; k < 9; ++k) {
          const double near = our(x + k % 3 - 1, y + k / 3 - 1, c);
          low = std::min(low, near), high = std::max(high, near);
        }
        const double error =
            std::abs(our(x, y, c) -
                     static_cast<double>(theirs.texels[(size_t{y} * kWidth + x) * theirs.channels + c]));
        within &= error <= 1 + (high - low) / 16 + slack;
        d.mean += error / 3;
        d.worst = std::max(d.worst, error);
      }
      ++d.compared;
      d.beyond += !within;
      if (!within && d.beyond < 9) std::printf("beyond at %u, %u\n", x, y);
    }
  d.mean /= static_cast<double>(std::max<size_t>(1, d.compared));
  return d;
}

constexpr const char* kEncodings[] = {"masters", "bc6h", "half", "exr", "hdr"};

// E of the map as the files of an encoding hold it, read by this program.
Status take_encoding(const std::string& name, const fs::path& folder, Lightmap& map) {
  std::vector<float> texels;  // 4 a texel
  if (name == "bc6h" || name == "half") {
    KILN_TRY(const Bytes file, read_file(folder / ("lightmap_" + name + "_E.ktx2")));
    KILN_TRY(const TextureImages images, read_ktx2(file));
    KILN_TRY(texels, decode_texels(images.format, images.levels[0][0], images.width, images.height));
  } else if (name == "exr") {
    KILN_TRY(const Planes file, read_exr(folder / "lightmap_E.exr"));
    for (size_t t = 0; t < file.data[0].size(); ++t)
      for (const char* channel : {"R", "G", "B", "B"}) texels.push_back(file.plane(channel)[t]);
  } else if (name == "hdr") {
    KILN_TRY(const Texture file, read_environment(folder / "lightmap_E.hdr"));
    for (size_t t = 0; t < file.texels.size() / 12; ++t) {
      float rgb[3];
      std::memcpy(rgb, &file.texels[12 * t], sizeof rgb);
      texels.insert(texels.end(), {rgb[0], rgb[1], rgb[2], 0});
    }
  } else {
    return {};
  }
  for (size_t c = 0; c < 3; ++c)
    for (size_t t = 0; t < map.planes.data[c].size(); ++t) map.planes.data[c][t] = texels[4 * t + c];
  return {};
}

// The demo at 2 texels a metre, few samples.
BakeRequest demo(const fs::path& out) {
  BakeRequest request;
  request.scene = test::source_dir() / "tests/scenes/arcade/arcade.gltf";
  request.output = out;
  request.worker_program = test::binary_dir() / "bin/kiln-worker";
  request.settings.layout = "pack";
  request.settings.texels_per_metre = 2;
  request.settings.min_samples = request.settings.max_samples = 16;
  request.settings.dds = false;
  return request;
}

ViewStyle plain_style() {
  ViewStyle style;
  style.exposure = kExposure;
  style.filmic = false;
  style.smooth = false;
  style.textures = false;
  return style;
}

// What the viewer shows with `query` against our renderer's picture of the map; `name`: of both pictures.
void expect_same_picture(const Published& published, uint16_t port, const std::string& name,
                         const std::string& query) {
  const fs::path pictures = test::binary_dir() / "viewer_test";
  fs::create_directories(pictures);
  const fs::path shot = pictures / ("viewer" + name + ".png");
  const auto browser = test::run_command(
      test::node_script("screenshot.mjs") + " 'http://127.0.0.1:" + std::to_string(port) +
      "/docs/examples/three/index.html?folder=/bake/&shading=plain&curve=srgb&textures=off&normals=off"
      "&exposure=0.5&ui=off&antialias=off&ratio=1&" +
      query + "' " + std::to_string(kWidth) + " " + std::to_string(kHeight) + " '" + shot.string() + "'");
  ASSERT_EQ(browser.exit_status, 0) << browser.output;
  const ViewStyle style = plain_style();
  const Picture ours = render_view(published.imported, published.atlas, published.map,
                                   published.imported.cameras.front(), kWidth, kHeight, style);
  ASSERT_TRUE(write_png(pictures / ("reference" + name + ".png"), kWidth, kHeight, ours.rgb));
  const auto theirs = decode_image(*read_file(shot), "screenshot");
  ASSERT_TRUE(theirs);
  ASSERT_EQ(theirs->width, kWidth);
  ASSERT_EQ(theirs->height, kHeight);
  const Difference d = compare(ours, *theirs, Comparable(published, style));
  std::printf(
      "%s: compared %zu of %u pixels: mean difference %.3f of 255, worst %.0f, beyond the tolerance %zu\n",
      query.c_str(), d.compared, kWidth * kHeight, d.mean, d.worst, d.beyond);
  EXPECT_GT(d.compared, kWidth * kHeight / 3);
  // Slivers thinner than a pixel between equal neighbours show in one picture and not in the other.
  EXPECT_LE(d.beyond, d.compared / 5000) << query;
  EXPECT_LT(d.mean, 0.5);
}

// Masters, and textures as the graphics card decodes them: three.js loads KTX2, EXR and HDR, and shows what
// this program's decoders and renderer show.
TEST(Viewer, ShowsWhatOurOwnRendererShows) {
  if (const auto why = test::no_node_tools(true)) GTEST_SKIP() << *why;
  test::TempDir dir;
  const fs::path out = dir.path() / "out";
  BakeRequest request = demo(out);
  request.settings.encodings = {"bc6h", "half", "exr", "hdr"};
  request.settings.encode_quantity = "irradiance";
  const auto report = run_bake(request, [](const BakeProgress&) {});
  ASSERT_TRUE(report) << report.error().message;
  auto published = test::read_published(request.scene, request.settings, out);
  ASSERT_TRUE(published) << published.error().message;
  ASSERT_FALSE(published->imported.cameras.empty());
  const auto server = ViewServer::start({out, test::source_dir() / "docs", 0});
  ASSERT_TRUE(server) << server.error().message;
  for (const std::string encoding : kEncodings) {
    const Status taken = take_encoding(encoding, out, published->map);
    ASSERT_TRUE(taken) << taken.error().message;
    expect_same_picture(*published, (*server)->port(), encoding == "masters" ? "" : "_" + encoding,
                        "light=normal&encoding=" + encoding);
    if (HasFatalFailure()) return;
  }
}

// The lobes of a local basis, evaluated at the surface's own normal, are E of every texel to 2e-5, and
// linear, so the basis must show the same picture as E does. A world basis would show curved surfaces a
// little otherwise.
TEST(Viewer, ShowsEOfAmbientDice) {
  if (const auto why = test::no_node_tools(true)) GTEST_SKIP() << *why;
  test::TempDir dir;
  const fs::path out = dir.path() / "out";
  BakeRequest request = demo(out);
  request.settings.basis = "ad9";
  request.settings.encodings = {"half"};
  const auto report = run_bake(request, [](const BakeProgress&) {});
  ASSERT_TRUE(report) << report.error().message;
  auto published = test::read_published(request.scene, request.settings, out);
  ASSERT_TRUE(published) << published.error().message;
  const auto server = ViewServer::start({out, test::source_dir() / "docs", 0});
  ASSERT_TRUE(server) << server.error().message;
  expect_same_picture(*published, (*server)->port(), "_ad9", "light=linear&encoding=masters");
}

}  // namespace
}  // namespace kiln

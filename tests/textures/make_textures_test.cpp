// From a map to files and back: what was written is read, decoded, and compared.
#include <fstream>
#include <map>

#include "common/atlas/texel_normals.h"
#include "common/base/files.h"
#include "coordinator/output/container/container.h"
#include "coordinator/output/textures/encodings.h"
#include "coordinator/output/textures/texel_codec.h"
#include "coordinator/output/textures/textures.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/textures/maps.h"

namespace kiln::test {
namespace {

struct Made {
  TempDir folder;
  Expected<TextureResult> result;

  explicit Made(const Baked& b)
      : result(make_textures({b.scene, b.atlas, b.map, b.settings, folder.path()})) {}
};

Baked with(Baked b, const std::vector<std::string>& encodings) {
  b.settings.encodings = encodings;
  return b;
}

// The planes of an encoding read back from its files: 4 floats a texel, level 0, pages stacked.
std::vector<float> read_back(const std::filesystem::path& folder, const PublishedTexture& t) {
  const Bytes bytes = *read_file(folder / t.uri);
  const TextureImages images = t.container == "ktx2" ? *read_ktx2(bytes) : *read_dds(bytes);
  EXPECT_EQ(images.levels.size(), t.levels);
  EXPECT_EQ(images.layers(), t.layers);
  std::vector<float> out;
  for (const Bytes& layer : images.levels[0]) {
    const std::vector<float> texels = *decode_texels(images.format, layer, images.width, images.height);
    out.insert(out.end(), texels.begin(), texels.end());
  }
  return out;
}

// The error that the report states is the error of the files: measured again from what was read.
TEST(MakeTextures, FilesDecodeToWhatTheReportSays) {
  const Baked b = with(baked_box(10, smooth_light()),
                       {"bc6h", "bc6h-bc1", "bc6h-plain", "half", "rgb9e5", "astc-4x4", "astc-6x6"});
  const Made made(b);
  ASSERT_TRUE(made.result) << made.result.error().message;
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  const std::vector<Vec3> normals = texel_normals(b.scene, b.atlas);
  const BasisInfo& basis = basis_roster()[*find_basis("sh_l1")];
  std::map<std::string, double> error;
  for (const TextureFigures& f : made.result->figures) error[f.encoding] = f.error.rel_mse;
  EXPECT_EQ(error.size(), 7u);
  for (const PublishedEncoding& e : made.result->list) {
    const std::vector<TextureLayout> layouts = layouts_of(encoding(e.name), basis, Quantity::kBasis);
    ASSERT_EQ(e.textures.size(), layouts.size()) << e.name << e.container;
    std::vector<std::vector<float>> texels;
    for (const PublishedTexture& t : e.textures) texels.push_back(read_back(made.folder.path(), t));
    std::vector<DecodedTexture> decoded;
    for (size_t k = 0; k < layouts.size(); ++k) {
      const TextureChannel& c = e.textures[k].channels[0];
      EXPECT_EQ(c.plane, layouts[k].plane[0]);
      EXPECT_EQ(c.times, layouts[k].times[0]);
      decoded.push_back({&layouts[k], {c.scale, c.bias}, texels[k]});
    }
    const TextureError again = measure_texture_error(level, &basis, normals, decoded, decoded);
    EXPECT_EQ(again.rel_mse, error[e.name]) << e.name << " " << e.container;
  }
  // A half is within 2^-12 of its value, evenly: (2^-12)^2 / 3 for each of four terms.
  EXPECT_LT(error["half"], 4 * 0x1p-24 / 3);
  EXPECT_LT(error["bc6h"], error["bc6h-bc1"]);
  EXPECT_LT(error["astc-4x4"], error["astc-6x6"]);
}

// The same for files that are no textures of a graphics card: PNG, HDR and EXR as their own readers give
// them.
TEST(MakeTextures, ImagesDecodeToWhatTheReportSays) {
  Baked b = with(baked_box(10, edge_of_light()), {"rgbe", "rgbm", "rgbd", "hdr", "exr", "png"});
  b.settings.encode_quantity = "irradiance";
  const Made made(b);
  ASSERT_TRUE(made.result) << made.result.error().message;
  const MapLevel level = map_levels(b.map, b.atlas, 0)[0];
  const BasisInfo& basis = basis_roster()[*find_basis("sh_l1")];
  for (size_t k = 0; k < made.result->list.size(); ++k) {
    const PublishedEncoding& e = made.result->list[k];
    ASSERT_EQ(e.textures.size(), 1u);
    const PublishedTexture& t = e.textures[0];
    TextureLayout layout = layouts_of(encoding(e.name), basis, Quantity::kIrradiance)[0];
    std::vector<float> texels;
    if (t.container == "png") {
      const Texture image = *decode_image(*read_file(made.folder.path() / t.uri), t.uri);
      ASSERT_EQ(image.channels, e.name == "png" ? 3u : 4u);
      for (size_t i = 0; i < image.texels.size(); ++i) {
        texels.push_back(static_cast<float>(std::to_integer<int>(image.texels[i])) / 255);
        if (image.channels == 3 && i % 3 == 2) texels.push_back(1);
      }
      EXPECT_EQ(t.unpack, e.name == "png" ? "srgb" : e.name);
    } else if (t.container == "hdr") {
      const Texture image = *read_environment(made.folder.path() / t.uri);
      for (size_t i = 0; i < image.texels.size() / 4; ++i) {
        float v;
        std::memcpy(&v, &image.texels[4 * i], sizeof v);
        texels.push_back(v);
        if (i % 3 == 2) texels.push_back(1);
      }
      layout.unpack = Unpack::kNone;
    } else {
      const Planes file = *read_exr(made.folder.path() / t.uri);
      for (size_t i = 0; i < file.data[0].size(); ++i)
        for (const char* channel : {"R", "G", "B", "R"}) texels.push_back(file.plane(channel)[i]);
    }
    const DecodedTexture decoded{&layout, {t.channels[0].scale, t.channels[0].bias}, texels};
    const TextureError again = measure_texture_error(level, nullptr, {}, {&decoded, 1}, {&decoded, 1});
    // Filtering before or after a product of two floats: a rounding.
    EXPECT_NEAR(again.rel_mse, made.result->figures[k].error.rel_mse, 1e-5 * again.rel_mse) << e.name;
  }
}

TEST(MakeTextures, PagesAreLayersAndLevelsShrink) {
  Baked b = with(baked_box(10, smooth_light(), 2), {"bc6h"});
  const Made made(b);
  ASSERT_TRUE(made.result) << made.result.error().message;
  for (const PublishedEncoding& e : made.result->list)
    for (const PublishedTexture& t : e.textures) {
      EXPECT_EQ(t.levels, 3u);
      EXPECT_EQ(t.layers, b.atlas.pages);
      EXPECT_EQ(t.width, b.atlas.width);
    }
  EXPECT_EQ(made.result->list.size(), 2u);   // dds and ktx2
  EXPECT_EQ(made.result->files.size(), 9u);  // two containers of four, and the error's picture
}

TEST(MakeTextures, SameBytesAgain) {
  const Baked b = with(baked_box(10, edge_of_light()), {"bc6h", "bc6h-bc1", "astc-4x4", "rgbm", "exr"});
  const Made one(b), two(b);
  ASSERT_TRUE(one.result);
  for (const std::string& file : one.result->files)
    EXPECT_EQ(*read_file(one.folder.path() / file), *read_file(two.folder.path() / file)) << file;
}

TEST(MakeTextures, NothingAskedNothingMade) {
  const Made made(with(baked_box(4, smooth_light()), {}));
  ASSERT_TRUE(made.result);
  EXPECT_TRUE(made.result->files.empty());
  EXPECT_TRUE(std::filesystem::is_empty(made.folder.path()));
}

TEST(MakeTextures, ABoundRaisesTheEffortAndThenWithholds) {
  Baked b = with(baked_box(10, edge_of_light()), {"bc6h"});
  b.settings.encode_effort = "fast";
  const Made loose(b);
  ASSERT_TRUE(loose.result);
  const double fast = loose.result->figures[0].error.relative_rms();
  EXPECT_EQ(loose.result->figures[0].effort, "fast");
  b.settings.max_encode_error = fast * 0.999;
  const Made tight(b);
  ASSERT_TRUE(tight.result);
  EXPECT_NE(tight.result->figures[0].effort, "fast");
  b.settings.max_encode_error = 1e-7;
  const Made impossible(b);
  ASSERT_TRUE(impossible.result);
  const TextureFigures& f = impossible.result->figures[0];
  EXPECT_EQ(f.effort, "best");
  EXPECT_FALSE(f.within_bound);
  EXPECT_TRUE(impossible.result->list.empty());
  for (const std::string& file : impossible.result->files)
    EXPECT_EQ(file.rfind("encode_error", 0), 0u) << file;
  const std::string sentence = beyond_bound(*impossible.result, b.settings);
  EXPECT_NE(sentence.find("bc6h"), sentence.npos);
  EXPECT_NE(sentence.find("--max-encode-error"), sentence.npos);
  EXPECT_EQ(beyond_bound(*loose.result, b.settings), "");
}

TEST(MakeTextures, WhatIsNotFiniteIsRefusedByItsPlace) {
  Baked b = with(baked_box(6, smooth_light()), {"bc6h"});
  size_t texel = 0;
  while (!b.atlas.owner[texel]) ++texel;
  for (const char* name : {"bc6h", "bc6h-plain", "half", "rgbm", "exr", "astc-4x4"})
    for (const float wrong : {NAN, INFINITY}) {
      b.settings.encodings = {name};
      b.map.planes.plane("L0.G")[texel] = wrong;
      const Made made(b);
      ASSERT_FALSE(made.result) << name << wrong;
      EXPECT_NE(made.result.error().message.find(std::to_string(texel % b.atlas.width) + ", " +
                                                 std::to_string(texel / b.atlas.width)),
                std::string::npos)
          << made.result.error().message;
    }
}

// Nobody's texels may hold anything: they are never read.
TEST(MakeTextures, EmptyTexelsDoNotCount) {
  Baked b = with(baked_box(10, smooth_light()), {"bc6h", "half", "rgbe", "astc-4x4", "exr"});
  const Made clean(b);
  for (size_t t = 0; t < b.atlas.owner.size(); ++t)
    if (!b.atlas.owner[t])
      for (std::vector<float>& plane : b.map.planes.data) plane[t] = t % 2 ? NAN : 1e30f;
  const Made dirty(b);
  ASSERT_TRUE(clean.result && dirty.result) << dirty.result.error().message;
  for (size_t k = 0; k < clean.result->figures.size(); ++k)
    EXPECT_EQ(clean.result->figures[k].error.rel_mse, dirty.result->figures[k].error.rel_mse);
}

TEST(MakeTextures, BlackMapsAndNoTexels) {
  Baked black =
      with(baked_box(6,
                     [](uint32_t, uint32_t) {
                       return Light{{0, 0, 0}, {0, 0, 0}};
                     }),
           {"bc6h", "bc6h-plain", "half", "rgb9e5", "rgbe", "rgbm", "rgbd", "exr", "hdr", "astc-6x6"});
  const Made made(black);
  ASSERT_TRUE(made.result) << made.result.error().message;
  for (const TextureFigures& f : made.result->figures) {
    EXPECT_EQ(f.error.rel_mse, 0) << f.encoding;
    EXPECT_EQ(f.clamped, 0u);
  }
  std::fill(black.map.validity.begin(), black.map.validity.end(), Validity::kEmpty);
  const Made empty(black);
  ASSERT_TRUE(empty.result) << empty.result.error().message;
  for (const TextureFigures& f : empty.result->figures) EXPECT_EQ(f.error.texels, 0u);
}

TEST(MakeTextures, UnitsAndQuantitiesAreSaid) {
  Baked b = with(baked_box(6, smooth_light()), {"half", "hdr"});
  b.settings.encode_quantity = "both";
  b.settings.encode_units = "e-over-pi";
  const Made made(b);
  ASSERT_TRUE(made.result) << made.result.error().message;
  std::map<std::string, PublishedTexture> by_name;
  for (const PublishedEncoding& e : made.result->list)
    if (e.container != "dds")
      for (const PublishedTexture& t : e.textures) by_name[t.uri] = t;
  EXPECT_EQ(by_name.size(), 6u);
  EXPECT_NEAR(by_name["lightmap_half_E.ktx2"].channels[0].scale, kPi, 1e-6);
  EXPECT_EQ(by_name["lightmap_half_L0.ktx2"].channels[0].scale, 1);
  size_t texel = 0;
  while (!b.atlas.owner[texel]) ++texel;
  const std::vector<float> e = read_back(made.folder.path(), by_name["lightmap_half_E.ktx2"]);
  EXPECT_NEAR(e[4 * texel] * kPi, b.map.planes.plane("E.R")[texel], 1e-3 * b.map.planes.plane("E.R")[texel]);
  EXPECT_EQ(by_name.count("lightmap_E.hdr"), 1u);
}

TEST(MakeTextures, HalfExrHoldsThePlanesThemselves) {
  const Baked b = with(baked_box(6, smooth_light()), {"exr"});
  const Made made(b);
  ASSERT_TRUE(made.result);
  const Planes file = *read_exr(made.folder.path() / "lightmap.exr");
  EXPECT_EQ(file.names.size(), 12u);
  for (const std::string& name : file.names)
    for (size_t t = 0; t < b.atlas.owner.size(); ++t)
      if (b.atlas.owner[t]) {
        ASSERT_EQ(file.plane(name)[t], from_half(to_half(b.map.planes.plane(name)[t])));
      }
}

TEST(MakeTextures, EveryEncodingOfTheSettingsIsInTheRoster) {
  ASSERT_EQ(encoding_names().size(), encoding_roster().size());
  for (const std::string_view name : encoding_names()) EXPECT_EQ(encoding(name).name, name);
  BakeSettings settings;
  EXPECT_FALSE(set_option(settings, "encode", "bc6h,jpeg", "test"));
  EXPECT_FALSE(set_option(settings, "encode", "", "test"));
  EXPECT_TRUE(set_option(settings, "encode", "none", "test"));
  EXPECT_TRUE(settings.encodings.empty());
  ASSERT_TRUE(set_option(settings, "encode", "astc-4x4,bc6h,bc6h", "test"));
  EXPECT_EQ(settings.encodings.size(), 2u);
  ASSERT_TRUE(set_option(settings, "container", "dds", "test"));
  EXPECT_FALSE(check_settings(settings)) << "DDS cannot hold ASTC";
}

// Without a bound of its own, compression is held to half of the reported error, at least 1 %: the default
// format gives way to the first finer one that keeps it; one that was asked for stays, with a warning.
TEST(MakeTextures, CompressionIsInProportionToTheReportedError) {
  Baked b = with(baked_box(10, edge_of_light()), {"bc6h"});
  ASSERT_EQ(b.settings.max_encode_error, kAutoBound);
  const Made chosen(b);
  ASSERT_TRUE(chosen.result);
  const TextureFigures& f = chosen.result->figures[0];
  EXPECT_EQ(f.bound, 0.01);  // no error is reported
  EXPECT_EQ(f.instead_of, "bc6h");
  EXPECT_GT(f.held_of_it, f.bound);
  EXPECT_LE(f.held, f.bound);
  EXPECT_EQ(chosen.result->list[0].name, f.encoding);
  EXPECT_TRUE(coarse_textures(*chosen.result).empty());
  b.settings.source["encode"] = "command line";
  const Made asked(b);
  ASSERT_TRUE(asked.result);
  EXPECT_EQ(asked.result->figures[0].encoding, "bc6h");
  EXPECT_TRUE(asked.result->figures[0].within_bound);
  const std::vector<std::string> warnings = coarse_textures(*asked.result);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("--encode half"), std::string::npos) << warnings[0];
  // A time limit has no room for more encodes.
  b.settings.source.clear();
  b.settings.time_limit = 60;
  const Made limited(b);
  ASSERT_TRUE(limited.result);
  EXPECT_EQ(limited.result->figures[0].encoding, "bc6h");
  EXPECT_EQ(limited.result->figures[0].effort, b.settings.encode_effort);
  EXPECT_EQ(coarse_textures(*limited.result).size(), 1u);
  b.settings.time_limit = 0;
  // As much again is reported as wrong: the default is fine enough.
  const Planes& p = b.map.planes;
  for (size_t t = 0; t < b.map.validity.size(); ++t)
    b.map.planes.plane("error")[t] = luminance(Vec3(p.plane("E.R")[t], p.plane("E.G")[t], p.plane("E.B")[t]));
  const Made noisy(b);
  ASSERT_TRUE(noisy.result);
  EXPECT_LE(noisy.result->figures[0].bound, 0.5);
  EXPECT_GT(noisy.result->figures[0].bound, 0.4);  // the dark side is nearer to a hundredth of the mean
  EXPECT_EQ(noisy.result->figures[0].encoding, "bc6h");
  EXPECT_EQ(noisy.result->figures[0].instead_of, "");
}

TEST(MakeTextures, WhatBlackTexelsMayHaveMissedAllowsNoCoarserOnes) {
  Baked b = with(baked_box(10, smooth_light()), {"bc6h"});
  Planes& p = b.map.planes;
  const auto bound = [&](float of_black) {
    for (size_t t = 0; t < b.map.validity.size(); ++t) {
      const bool is_black = t % 4 == 0;
      for (size_t plane = 0; is_black && plane < 15; ++plane) p.data[plane][t] = 0;
      p.plane("error")[t] = is_black ? of_black : 0.1f * p.plane("E.G")[t];
    }
    const Made made(b);
    EXPECT_TRUE(made.result);
    return made.result ? made.result->figures[0].bound : 0;
  };
  const double without = bound(0);
  EXPECT_GT(without, 0.03);
  EXPECT_EQ(bound(1), without);
}

// Every response of the roster, 0.5 in all its planes.
void add_responses(Baked& b) {
  Planes& planes = b.map.responses;
  planes.width = b.map.planes.width;
  planes.height = b.map.planes.height;
  for (uint32_t k = 0; k < response_roster().size(); ++k) {
    b.settings.quantities.responses.push_back(k);
    for (size_t stored = 0; stored < response_roster()[k].stored.size(); ++stored)
      for (float& value : planes.add(response_plane(response_roster()[k], stored))) value = 0.5f;
  }
}

// Needs said for a plan are not below what is written.
TEST(MakeTextures, PlannedBytesAreAnUpperEstimate) {
  for (const bool light : {true, false})
    for (const char* name : {"bc6h", "half", "rgbm", "exr"}) {
      Baked b = with(baked_box(10, smooth_light(), 2), {name});
      add_responses(b);
      b.settings.quantities.light = b.map.has_light = light;
      const Made made(b);
      uint64_t bytes = 0;
      for (const std::string& file : made.result->files)
        bytes += std::filesystem::file_size(made.folder.path() / file);
      const uint64_t headers = 2000 * made.result->files.size();
      EXPECT_LE(bytes, texture_needs(b.settings, b.atlas.texel_count()).disk * 11 / 10 + headers) << name;
    }
}

}  // namespace
}  // namespace kiln::test

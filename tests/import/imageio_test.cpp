#include "coordinator/scene/imageio/imageio.h"

#include <array>
#include <cstring>
#include <limits>

#include "common/base/files.h"
#include "common/math/vec.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {

// A flat (not run-length coded) Radiance picture of RGBE texels.
std::string hdr_file(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& texels) {
  std::string out = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " +
                    std::to_string(width) + "\n";
  for (const auto& t : texels) out.append(reinterpret_cast<const char*>(t.data()), 4);
  return out;
}

// An uncompressed scan-line EXR with channels B, G, R of float, written by hand after the format's
// specification, because no writer of ours would let a NaN through.
std::string exr_file(uint32_t width, uint32_t height, const std::vector<Vec3>& rgb) {
  std::string out;
  const auto put = [&out](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto attribute = [&](const char* name, const char* type, const std::string& value) {
    out.append(name).push_back('\0');
    out.append(type).push_back('\0');
    put(static_cast<uint32_t>(value.size()));
    out += value;
  };
  const auto words = [](std::initializer_list<uint32_t> list) {
    std::string s;
    for (const uint32_t w : list) s.append(reinterpret_cast<const char*>(&w), 4);
    return s;
  };
  put(uint32_t{20000630});
  put(uint32_t{2});
  std::string channels;
  for (const char* name : {"B", "G", "R"}) channels += std::string(name) + '\0' + words({2, 0, 1, 1});
  attribute("channels", "chlist", channels + '\0');
  attribute("compression", "compression", std::string(1, '\0'));
  attribute("dataWindow", "box2i", words({0, 0, width - 1, height - 1}));
  attribute("displayWindow", "box2i", words({0, 0, width - 1, height - 1}));
  attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  attribute("pixelAspectRatio", "float", words({0x3f800000}));
  attribute("screenWindowCenter", "v2f", words({0, 0}));
  attribute("screenWindowWidth", "float", words({0x3f800000}));
  out.push_back('\0');
  const uint64_t line = 8 + uint64_t{width} * 12;
  for (uint64_t y = 0, first = out.size() + 8 * uint64_t{height}; y < height; ++y) put(first + y * line);
  for (uint32_t y = 0; y < height; ++y) {
    put(y);
    put(width * 12);
    for (const int c : {2, 1, 0})
      for (uint32_t x = 0; x < width; ++x) put(rgb[y * width + x][c]);
  }
  return out;
}

Expected<Texture> environment_of(const std::string& content, const char* name) {
  test::TempDir dir;
  EXPECT_TRUE(write_file_atomic(dir.path() / name, content));
  return read_environment(dir.path() / name);
}

std::vector<float> floats_of(const Texture& t) {
  std::vector<float> out(t.texels.size() / 4);
  std::memcpy(out.data(), t.texels.data(), t.texels.size());
  return out;
}

TEST(ImageIo, PngRoundTrip) {
  const std::vector<uint8_t> rgb{255, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const auto png = encode_png(2, 2, rgb);
  ASSERT_TRUE(png) << png.error().message;
  const auto texture = decode_image(*png, "a.png");
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->width, 2u);
  EXPECT_EQ(texture->height, 2u);
  EXPECT_EQ(texture->channels, 3u);
  EXPECT_EQ(texture->format, TexelFormat::kUnorm8);
  EXPECT_EQ(std::memcmp(texture->texels.data(), rgb.data(), rgb.size()), 0);

  test::TempDir dir;
  ASSERT_TRUE(write_png(dir.path() / "a.png", 2, 2, rgb));
  EXPECT_EQ(read_file(dir.path() / "a.png").value(), *png);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1)
      << "a temporary file is left";
  EXPECT_FALSE(write_png(dir.path() / "no/a.png", 2, 2, rgb));
}

// 1x1 RGBA (200, 100, 50, 128): glTF's alpha is not premultiplied, so colours come back as they were.
TEST(ImageIo, AlphaDoesNotChangeColours) {
  const uint8_t png[] = {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
                         0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x06, 0x00, 0x00,
                         0x00, 0x1f, 0x15, 0xc4, 0x89, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x44, 0x41, 0x54, 0x78,
                         0x9c, 0x63, 0x38, 0x91, 0x62, 0xd4, 0x00, 0x00, 0x05, 0x35, 0x01, 0xdf, 0x73, 0x62,
                         0xe3, 0xdb, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  const auto texture = decode_image(std::as_bytes(std::span(png)), "rgba.png");
  ASSERT_TRUE(texture) << texture.error().message;
  ASSERT_EQ(texture->channels, 4u);
  const std::vector<std::byte> expected{std::byte{200}, std::byte{100}, std::byte{50}, std::byte{128}};
  EXPECT_EQ(texture->texels, expected);
}

TEST(ImageIo, WhatIsNoImageIsRefusedByName) {
  Bytes png = test::small_png(9, 9, 9, 64);
  EXPECT_SAYS(test::message_of(decode_image({}, "empty.png")),
              "empty.png: its content is not a supported image");
  EXPECT_SAYS(test::message_of(decode_image(bytes_of("hello, world"), "a.png")),
              "a.png: its content is not a supported image");
  for (size_t size = 8; size + 12 < png.size(); size += 7)  // whatever stays, it must not crash
    (void)decode_image(std::span(png).first(size), "cut.png");
  EXPECT_FALSE(decode_image(std::span(png).first(40), "cut.png"));
  for (const auto format : {"\xff\xd8\xff\xe0", "RIFF....WEBP", "BM", "#?RADIANCE\n", "\x76\x2f\x31\x01"})
    EXPECT_FALSE(decode_image(bytes_of(format), "head only")) << format;
}

TEST(ImageIo, HugeImagesAreRefused) {
  const auto strip = encode_png(16385, 1, std::vector<uint8_t>(3 * 16385, 7));
  ASSERT_TRUE(strip);
  EXPECT_SAYS(test::message_of(decode_image(*strip, "strip.png")),
              "strip.png: 16385 x 1 texels are more than the limits");
  EXPECT_TRUE(decode_image(encode_png(16384, 1, std::vector<uint8_t>(3 * 16384, 7)).value(), "strip.png"));
  // A header alone that promises 12 GiB of floats.
  const std::string sky = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 65536\n";
  EXPECT_SAYS(test::message_of(environment_of(sky, "sky.hdr")), "more than the limits");
}

TEST(ImageIo, HdrEnvironment) {
  // 128 is 0.5 of the mantissa; exponent 129 is 2^1, so (128, 64, 0, 129) is (1, 0.5, 0) and half a step.
  const auto texture = environment_of(hdr_file(2, 1, {{128, 64, 0, 129}, {128, 128, 128, 140}}), "sky.hdr");
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->format, TexelFormat::kFloat32);
  EXPECT_EQ(texture->channels, 3u);
  const auto rgb = floats_of(*texture);
  EXPECT_NEAR(rgb[0], 1.0f, 0.01f);
  EXPECT_NEAR(rgb[1], 0.5f, 0.01f);
  EXPECT_NEAR(rgb[2], 0.0f, 0.01f);
  EXPECT_NEAR(rgb[3], 2048.0f, 16.0f);
}

TEST(ImageIo, ExrEnvironmentIsExact) {
  const std::vector<Vec3> rgb{{0, 1, 2}, {0.25f, 1e6f, 3}, {4, 5, 6}, {7, 8, 9}};
  const auto texture = environment_of(exr_file(2, 2, rgb), "sky.exr");
  ASSERT_TRUE(texture) << texture.error().message;
  const auto floats = floats_of(*texture);
  for (size_t i = 0; i < 12; ++i) EXPECT_EQ(floats[i], rgb[i / 3][static_cast<int>(i % 3)]) << i;
}

TEST(ImageIo, BadEnvironmentTexelsAreNamed) {
  const auto message = [](float bad) {
    std::vector<Vec3> rgb(6, Vec3(1));
    rgb[4].y = bad;
    return test::message_of(environment_of(exr_file(3, 2, rgb), "sky.exr"));
  };
  EXPECT_SAYS(message(std::nanf("")),
              "sky.exr: texel (1, 1), counted from the top left, is NaN in channel G");
  EXPECT_SAYS(message(std::numeric_limits<float>::infinity()),
              "texel (1, 1), counted from the top left, is infinite");
  EXPECT_SAYS(message(-0.5f), "texel (1, 1), counted from the top left, is negative in channel G");
  EXPECT_SAYS(
      test::message_of(environment_of(exr_file(3, 2, std::vector<Vec3>(6)).substr(0, 300), "cut.exr")),
      "cut.exr");
  EXPECT_SAYS(test::message_of(read_environment("/nowhere/sky.exr")), "/nowhere/sky.exr: no such file");
}

}  // namespace
}  // namespace kiln

// DDS files: the header word by word, OpenImageIO's reader, round trips.
#include <bit>
#include <cstring>

#include "tests/container/oiio_dds.h"
#include "tests/container/pictures.h"

namespace kiln {
namespace {

std::vector<TextureFormat> dds_formats() {
  std::vector<TextureFormat> list;
  for (const TextureFormatInfo& info : texture_formats())
    if (info.dxgi) list.push_back(info.format);
  return list;
}

TEST(Dds, HeaderWordByWord) {
  const TextureImages t = test::picture(TextureFormat::kBc7Unorm, 37, 18, 3, 0);
  const auto file = write_dds(t);
  ASSERT_TRUE(file) << file.error().message;
  const uint32_t linear = 10 * 5 * 16, levels = 6;
  std::vector<uint32_t> expected(37, 0);
  expected[0] = 0x20534444;                  // "DDS "
  expected[1] = 124;                         // dwSize
  expected[2] = 0x1007 | 0x20000 | 0x80000;  // caps, height, width, format; levels; linear size
  expected[3] = 18, expected[4] = 37, expected[5] = linear, expected[7] = levels;
  expected[19] = 32, expected[20] = 4, expected[21] = 0x30315844;  // pixel format: FourCC "DX10"
  expected[27] = 0x1000 | 8 | 0x400000;                            // texture, complex, levels
  expected[32] = 98, expected[33] = 3, expected[35] = 3;           // DXGI_FORMAT_BC7_UNORM, 2D, layers
  for (size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(test::word_at(*file, 4 * i), expected[i]) << "word " << i;
  // Layer by layer, in each all levels.
  size_t at = 148;
  for (uint32_t layer = 0; layer < 3; ++layer)
    for (const auto& level : t.levels) {
      ASSERT_LE(at + level[layer].size(), file->size());
      EXPECT_EQ(std::memcmp(&(*file)[at], level[layer].data(), level[layer].size()), 0);
      at += level[layer].size();
    }
  EXPECT_EQ(at, file->size());
}

TEST(Dds, PitchOfPlainFormatsAndNoLevels) {
  const auto file = write_dds(test::picture(TextureFormat::kRgba16Float, 5, 3, 1, 1));
  ASSERT_TRUE(file);
  EXPECT_EQ(test::word_at(*file, 8), 0x1007u | 8);
  EXPECT_EQ(test::word_at(*file, 20), 5u * 8);
  EXPECT_EQ(test::word_at(*file, 28), 0u);
  EXPECT_EQ(test::word_at(*file, 108), 0x1000u);
  EXPECT_EQ(test::word_at(*file, 128), 10u);
}

TEST(Dds, RoundTrips) {
  for (const TextureFormat format : dds_formats())
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 5u}, {16u, 16u}, {33u, 7u}})
      for (const uint32_t layers : {1u, 4u}) {
        const TextureImages t = test::picture(format, width, height, layers, 0);
        const auto file = write_dds(t);
        ASSERT_TRUE(file);
        const auto back = read_dds(*file);
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->format, format);
        EXPECT_EQ(back->width, width);
        EXPECT_EQ(back->height, height);
        EXPECT_EQ(back->levels, t.levels);
      }
}

TEST(Dds, OpenImageIoReadsSizesLevelsAndTexels) {
  for (const TextureFormat format : dds_formats()) {
    const std::string_view name = texture_format(format).name;
    // OpenImageIO 2.4 knows neither floats nor BC4 and BC5 with sign in DDS files.
    if (texture_format(format).block_x == 1 && format != TextureFormat::kRgba8Unorm) continue;
    if (name.find("SNORM") != name.npos) continue;
    const TextureImages t = test::picture(format, 20, 12, 1, 0);
    const auto file = write_dds(t);
    ASSERT_TRUE(file);
    for (int level = 0; level < 5; ++level) {
      const auto got = test::oiio_read_dds(*file, level);
      EXPECT_EQ(got.error, "") << name;
      EXPECT_EQ(got.levels, 5) << name;
      EXPECT_EQ(got.width, std::max(1, 20 >> level)) << name;
      EXPECT_EQ(got.height, std::max(1, 12 >> level)) << name;
      // The level by itself as a file decodes to the same.
      TextureImages one{
          format, static_cast<uint32_t>(got.width), static_cast<uint32_t>(got.height), {t.levels[level]}};
      const auto alone = test::oiio_read_dds(*write_dds(one));
      EXPECT_EQ(alone.error, "") << name;
      EXPECT_EQ(std::memcmp(alone.floats.data(), got.floats.data(), 4 * got.floats.size()), 0)
          << name << level;
      if (format == TextureFormat::kRgba8Unorm)
        EXPECT_EQ(std::memcmp(got.bytes.data(), t.levels[level][0].data(), got.bytes.size()), 0) << level;
    }
  }
}

TEST(Dds, OlderNamesWhereThereAreNoLayers) {
  const auto bc1 = write_dds(test::picture(TextureFormat::kBc1Unorm, 8, 8, 1, 1));
  ASSERT_TRUE(bc1);
  EXPECT_EQ(bc1->size(), 128u + 4 * 8);
  EXPECT_EQ(std::memcmp(&(*bc1)[84], "DXT1", 4), 0);
  const auto rgba = write_dds(test::picture(TextureFormat::kRgba8Unorm, 8, 8, 1, 1));
  ASSERT_TRUE(rgba);
  EXPECT_EQ(rgba->size(), 128u + 64 * 4);
  EXPECT_EQ(test::word_at(*rgba, 80), 0x41u);
  const auto array = write_dds(test::picture(TextureFormat::kBc1Unorm, 8, 8, 2, 1));
  ASSERT_TRUE(array);
  EXPECT_EQ(std::memcmp(&(*array)[84], "DX10", 4), 0);
  EXPECT_EQ(test::word_at(*array, 128), 71u);
  EXPECT_EQ(test::word_at(*array, 108), 0x1008u);  // texture, complex: more than one image
}

// By DXGI_FORMAT when written; by the names that tools gave them before there was one when read, too.
TEST(Dds, ChannelsByNumberAndByOlderNames) {
  const struct {
    TextureFormat format;
    uint32_t dxgi;
    std::vector<const char*> names;
  } rows[] = {{TextureFormat::kBc4Unorm, 80, {"ATI1", "BC4U"}},
              {TextureFormat::kBc4Snorm, 81, {"BC4S"}},
              {TextureFormat::kBc5Unorm, 83, {"ATI2", "BC5U"}},
              {TextureFormat::kBc5Snorm, 84, {"BC5S"}}};
  for (const auto& row : rows) {
    const TextureImages t = test::picture(row.format, 20, 12, 1, 0);
    const auto file = write_dds(t);
    ASSERT_TRUE(file);
    EXPECT_EQ(std::memcmp(&(*file)[84], "DX10", 4), 0);
    EXPECT_EQ(test::word_at(*file, 128), row.dxgi);
    for (const char* name : row.names) {
      Bytes older = *file;
      older.erase(older.begin() + 128, older.begin() + 148);
      std::memcpy(&older[84], name, 4);
      const auto back = read_dds(older);
      ASSERT_TRUE(back) << name << ": " << back.error().message;
      EXPECT_EQ(back->format, row.format) << name;
      EXPECT_EQ(back->levels, t.levels) << name;
    }
  }
}

TEST(Dds, RefusesWhatItCannotHold) {
  const auto astc = write_dds(test::picture(TextureFormat::kAstc6x6Unorm, 8, 8, 1, 1));
  ASSERT_FALSE(astc);
  EXPECT_EQ(astc.error().message, "DDS does not know ASTC_6x6_UNORM_BLOCK: write it as KTX2");
  EXPECT_FALSE(write_dds({TextureFormat::kBc7Unorm, 4, 4, {}}));
  EXPECT_FALSE(write_dds({TextureFormat::kBc7Unorm, 16385, 4, {{Bytes(16 * 4097)}}}));
  const auto size = write_dds({TextureFormat::kBc7Unorm, 4, 4, {{Bytes(15)}}});
  ASSERT_FALSE(size);
  EXPECT_EQ(size.error().message, "level 0, layer 0 of the texture has 15 bytes, BC7_UNORM_BLOCK take 16");
  EXPECT_FALSE(write_dds({TextureFormat::kBc7Unorm, 4, 4, {{Bytes(16)}, {Bytes(16), Bytes(16)}}}));
}

}  // namespace
}  // namespace kiln

// KTX2 files against the specification, field by field.
#include <cstring>
#include <map>

#include "common/zstd/compress.h"
#include "tests/container/pictures.h"

namespace kiln {
namespace {

using test::picture;
using test::word_at;

uint64_t long_at(std::span<const std::byte> file, size_t offset) {
  return word_at(file, offset) | uint64_t{word_at(file, offset + 4)} << 32;
}

TEST(Ktx2, HeaderAndIndexFieldByField) {
  const TextureImages t = picture(TextureFormat::kBc6hUfloat, 20, 9, 2, 0);  // 20x9, 10x4, 5x2, 2x1, 1x1
  const auto made = write_ktx2(t, 0);
  ASSERT_TRUE(made) << made.error().message;
  const Bytes& file = *made;
  const uint8_t identifier[12] = {0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a};
  EXPECT_EQ(std::memcmp(file.data(), identifier, 12), 0);
  EXPECT_EQ(word_at(file, 12), 143u);  // VK_FORMAT_BC6H_UFLOAT_BLOCK
  EXPECT_EQ(word_at(file, 16), 1u);    // typeSize of blocks
  EXPECT_EQ(word_at(file, 20), 20u);
  EXPECT_EQ(word_at(file, 24), 9u);
  EXPECT_EQ(word_at(file, 28), 0u);  // depth
  EXPECT_EQ(word_at(file, 32), 2u);  // layers
  EXPECT_EQ(word_at(file, 36), 1u);  // faces
  EXPECT_EQ(word_at(file, 40), 5u);  // levels
  EXPECT_EQ(word_at(file, 44), 0u);  // supercompression
  const uint32_t dfd = word_at(file, 48), kvd = word_at(file, 56);
  EXPECT_EQ(dfd, 80u + 5 * 24);
  EXPECT_EQ(word_at(file, 52), 44u);
  EXPECT_EQ(kvd, dfd + 44);
  EXPECT_EQ(long_at(file, 64), 0u);  // no global data
  EXPECT_EQ(long_at(file, 72), 0u);
  // Levels: smallest first, each at a multiple of lcm(16, 4), nothing between but that.
  uint64_t at = kvd + word_at(file, 60);
  for (int level = 4; level >= 0; --level) {
    at = (at + 15) / 16 * 16;
    const size_t row = 80 + 24 * static_cast<size_t>(level);
    const auto& images = t.levels[static_cast<size_t>(level)];
    EXPECT_EQ(long_at(file, row), at) << level;
    EXPECT_EQ(long_at(file, row + 8), 2 * images[0].size()) << level;
    EXPECT_EQ(long_at(file, row + 16), 2 * images[0].size()) << level;
    for (const Bytes& image : images) {
      EXPECT_EQ(std::memcmp(&file[at], image.data(), image.size()), 0) << level;
      at += image.size();
    }
  }
  EXPECT_EQ(at, file.size());
}

TEST(Ktx2, KeysAreSortedTerminatedAndPadded) {
  const auto file =
      write_ktx2(picture(TextureFormat::kRgb9e5, 4, 4, 1, 1), 0, {{"zeta", "9"}, {"Alpha", "first"}});
  ASSERT_TRUE(file);
  size_t at = word_at(*file, 56);
  const size_t end = at + word_at(*file, 60);
  std::vector<std::string> pairs;
  while (at < end) {
    const uint32_t size = word_at(*file, at);
    pairs.emplace_back(reinterpret_cast<const char*>(&(*file)[at + 4]), size);
    for (size_t pad = at + 4 + size; pad % 4; ++pad) EXPECT_EQ((*file)[pad], std::byte{0});
    at += (4 + size + 3) / 4 * 4;
  }
  EXPECT_EQ(at, end);
  using namespace std::string_literals;
  EXPECT_EQ(pairs,
            (std::vector{"Alpha\0first\0"s, "KTXorientation\0rd\0"s, "KTXwriter\0Kiln\0"s, "zeta\0009\0"s}));
  EXPECT_EQ(word_at(*file, 32), 0u);  // one layer is no array
  for (const char* key : {"", "KTXown", "ktxown"})
    EXPECT_FALSE(write_ktx2(picture(TextureFormat::kRgb9e5, 4, 4, 1, 1), 0, {{key, "x"}})) << key;
  EXPECT_FALSE(write_ktx2(picture(TextureFormat::kRgb9e5, 4, 4, 1, 1), 0, {{"a", "x"}, {"a", "y"}}));
}

// Khronos Data Format Specification 1.4: model (table of section 5.6), block, samples as
// {first bit, bits, channel and qualifiers, lower, upper}.
struct Descriptor {
  uint32_t vulkan, type_size, model, block_x, block_y, bytes;
  std::vector<std::vector<uint32_t>> samples;
};

std::map<TextureFormat, Descriptor> descriptors() {
  constexpr uint32_t kAll = 0xffffffff, kOne = 0x3f800000, kMinusOne = 0xbf800000;
  const std::vector<std::vector<uint32_t>> unorm = {{0, 128, 0, 0, kAll}},
                                           sfloat = {{0, 128, 0xc0, kMinusOne, kOne}};
  const auto rgba = [&](uint32_t bits) {
    std::vector<std::vector<uint32_t>> list;
    for (uint32_t c = 0; c < 4; ++c)
      list.push_back({bits * c, bits, 0xc0 | (c < 3 ? c : 15u), kMinusOne, kOne});
    return list;
  };
  return {
      {TextureFormat::kRgba8Unorm,
       {37, 1, 1, 1, 1, 4, {{0, 8, 0, 0, 255}, {8, 8, 1, 0, 255}, {16, 8, 2, 0, 255}, {24, 8, 15, 0, 255}}}},
      {TextureFormat::kRgba16Float, {97, 2, 1, 1, 1, 8, rgba(16)}},
      {TextureFormat::kRgba32Float, {109, 4, 1, 1, 1, 16, rgba(32)}},
      {TextureFormat::kRgb9e5,
       {123,
        4,
        1,
        1,
        1,
        4,
        {{0, 9, 0, 0, 8448},
         {27, 5, 0x20, 15, 31},
         {9, 9, 1, 0, 8448},
         {27, 5, 0x21, 15, 31},
         {18, 9, 2, 0, 8448},
         {27, 5, 0x22, 15, 31}}}},
      {TextureFormat::kRg16Float,
       {83, 2, 1, 1, 1, 4, {{0, 16, 0xc0, kMinusOne, kOne}, {16, 16, 0xc1, kMinusOne, kOne}}}},
      {TextureFormat::kBc1Unorm, {131, 1, 128, 4, 4, 8, {{0, 64, 0, 0, kAll}}}},
      {TextureFormat::kBc4Unorm, {139, 1, 131, 4, 4, 8, {{0, 64, 0, 0, kAll}}}},
      {TextureFormat::kBc4Snorm, {140, 1, 131, 4, 4, 8, {{0, 64, 0x40, 0x80000000, 0x7fffffff}}}},
      {TextureFormat::kBc5Unorm, {141, 1, 132, 4, 4, 16, {{0, 64, 0, 0, kAll}, {64, 64, 1, 0, kAll}}}},
      {TextureFormat::kBc5Snorm,
       {142,
        1,
        132,
        4,
        4,
        16,
        {{0, 64, 0x40, 0x80000000, 0x7fffffff}, {64, 64, 0x41, 0x80000000, 0x7fffffff}}}},
      {TextureFormat::kBc6hUfloat, {143, 1, 133, 4, 4, 16, {{0, 128, 0x80, 0, kOne}}}},
      {TextureFormat::kBc6hSfloat, {144, 1, 133, 4, 4, 16, sfloat}},
      {TextureFormat::kBc7Unorm, {145, 1, 134, 4, 4, 16, unorm}},
      {TextureFormat::kAstc4x4Unorm, {157, 1, 162, 4, 4, 16, unorm}},
      {TextureFormat::kAstc6x6Unorm, {165, 1, 162, 6, 6, 16, unorm}},
      {TextureFormat::kAstc8x8Unorm, {171, 1, 162, 8, 8, 16, unorm}},
      {TextureFormat::kAstc4x4Sfloat, {1000066000, 1, 162, 4, 4, 16, sfloat}},
      {TextureFormat::kAstc6x6Sfloat, {1000066004, 1, 162, 6, 6, 16, sfloat}},
      {TextureFormat::kAstc8x8Sfloat, {1000066007, 1, 162, 8, 8, 16, sfloat}},
  };
}

TEST(Ktx2, DescriptorOfEveryFormat) {
  const auto expected = descriptors();
  ASSERT_EQ(expected.size(), static_cast<size_t>(kTextureFormats));
  for (const auto& [format, d] : expected)
    for (const int zstd : {0, 3}) {
      SCOPED_TRACE(texture_format(format).name);
      const auto file = write_ktx2(picture(format, 16, 16, 1, 1), zstd);
      ASSERT_TRUE(file);
      EXPECT_EQ(word_at(*file, 12), d.vulkan);
      EXPECT_EQ(word_at(*file, 16), d.type_size);
      const size_t at = word_at(*file, 48);
      const auto count = static_cast<uint32_t>(d.samples.size());
      EXPECT_EQ(word_at(*file, at), 28 + 16 * count);
      EXPECT_EQ(word_at(*file, at), word_at(*file, 52));
      EXPECT_EQ(word_at(*file, at + 4), 0u);                           // Khronos, basic descriptor
      EXPECT_EQ(word_at(*file, at + 8), 2 | (24 + 16 * count) << 16);  // version and size
      EXPECT_EQ(word_at(*file, at + 12), d.model | 1 << 8 | 1 << 16);  // BT.709, linear, straight alpha
      EXPECT_EQ(word_at(*file, at + 16), (d.block_x - 1) | (d.block_y - 1) << 8);
      EXPECT_EQ(word_at(*file, at + 20), d.bytes);
      EXPECT_EQ(word_at(*file, at + 24), 0u);
      for (uint32_t i = 0; i < count; ++i) {
        const size_t s = at + 28 + 16 * i;
        const auto& e = d.samples[i];
        EXPECT_EQ(word_at(*file, s), e[0] | (e[1] - 1) << 16 | e[2] << 24) << i;
        EXPECT_EQ(word_at(*file, s + 4), 0u) << i;  // position
        EXPECT_EQ(word_at(*file, s + 8), e[3]) << i;
        EXPECT_EQ(word_at(*file, s + 12), e[4]) << i;
      }
    }
}

TEST(Ktx2, RoundTrips) {
  for (const TextureFormatInfo& info : texture_formats())
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 5u}, {16u, 16u}, {33u, 7u}})
      for (const uint32_t layers : {1u, 4u})
        for (const int zstd : {0, 1, 19}) {
          SCOPED_TRACE(info.name);
          const TextureImages t = picture(info.format, width, height, layers, 0);
          const auto file = write_ktx2(t, zstd, {{"kiln.page", "1"}});
          ASSERT_TRUE(file);
          const auto back = read_ktx2(*file);
          ASSERT_TRUE(back) << back.error().message;
          EXPECT_EQ(back->format, info.format);
          EXPECT_EQ(back->width, width);
          EXPECT_EQ(back->height, height);
          EXPECT_EQ(back->levels, t.levels);
        }
}

TEST(Ktx2, SupercompressedLevelsAreFramesWithoutPadding) {
  TextureImages t = picture(TextureFormat::kBc7Unorm, 64, 64, 2, 0);
  for (auto& level : t.levels)
    for (Bytes& image : level) std::fill(image.begin(), image.end(), std::byte{7});
  const auto file = write_ktx2(t, 5);
  ASSERT_TRUE(file);
  EXPECT_EQ(word_at(*file, 44), 2u);
  uint64_t at = word_at(*file, 56) + word_at(*file, 60);
  for (size_t level = t.levels.size(); level-- > 0;) {
    EXPECT_EQ(long_at(*file, 80 + 24 * level), at);
    const uint64_t bytes = long_at(*file, 88 + 24 * level), unpacked = long_at(*file, 96 + 24 * level);
    EXPECT_EQ(unpacked, 2 * t.levels[level][0].size());
    const auto data = decompress(std::span(*file).subspan(at, bytes), unpacked);
    ASSERT_TRUE(data);
    EXPECT_EQ(*data, Bytes(unpacked, std::byte{7}));
    at += bytes;
  }
  EXPECT_EQ(at, file->size());
  EXPECT_LT(file->size(), 1000u);  // 10,944 bytes of texels
}

}  // namespace
}  // namespace kiln

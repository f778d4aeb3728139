// Files of strangers: each field that is wrong is an error that names it, and nothing is allocated for sizes
// that the file does not have.
#include <cstring>

#include "tests/container/pictures.h"

namespace kiln {
namespace {

using test::picture;

Bytes changed(Bytes file, size_t offset, uint64_t value, size_t size = 4) {
  std::memcpy(&file[offset], &value, size);
  return file;
}

struct Damage {
  Bytes file;
  std::string expected;  // part of the message
};

TEST(Damage, DdsFieldsAreNamed) {
  const Bytes good = *write_dds(picture(TextureFormat::kBc7Unorm, 16, 8, 2, 0));
  const Damage cases[] = {
      {Bytes(good.begin() + 1, good.end()), "\"DDS \""},
      {changed(good, 4, 125), "size of 124"},
      {changed(good, 76, 31), "size of 32"},
      {changed(good, 12, 0), "16 x 0 texels"},
      {changed(good, 16, 0xffffffff), "4294967295 x 8 texels"},
      {changed(good, 16, 16384), "its header asks for"},
      {changed(good, 28, 6), "6 levels"},
      {changed(good, 28, 0xffffffff), "4294967295 levels"},
      {changed(good, 84, 0), "pixel format"},
      {changed(good, 112, 0x200), "cube or a volume"},
      {changed(good, 112, 0x200000), "cube or a volume"},
      {changed(good, 128, 99), "DXGI format 99"},  // BC7_UNORM_SRGB
      {changed(good, 132, 4), "cube or a volume"},
      {changed(good, 136, 4), "cube or a volume"},
      {changed(good, 140, 0), "0 layers"},
      {changed(good, 140, 0xffffffff), "4294967295 layers"},
      {Bytes(good.begin(), good.begin() + 140), "within its header"},
      {Bytes(good.begin(), good.end() - 1), "its header asks for"},
  };
  for (const Damage& d : cases) {
    const auto result = read_dds(d.file);
    ASSERT_FALSE(result) << d.expected;
    EXPECT_NE(result.error().message.find(d.expected), std::string::npos) << result.error().message;
    EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);
  }
  EXPECT_FALSE(read_dds(good, 100));
  EXPECT_TRUE(read_dds(good));
}

TEST(Damage, Ktx2FieldsAreNamed) {
  const Bytes good = *write_ktx2(picture(TextureFormat::kBc7Unorm, 16, 8, 2, 0), 0);
  const Bytes packed = *write_ktx2(picture(TextureFormat::kBc7Unorm, 16, 8, 2, 0), 3);
  uint32_t dfd, kvd, kvd_bytes;
  std::memcpy(&dfd, &good[48], 4);
  std::memcpy(&kvd, &good[56], 4);
  std::memcpy(&kvd_bytes, &good[60], 4);
  const Damage cases[] = {
      {Bytes(good.begin(), good.begin() + 79), "shorter than its header"},
      {changed(good, 0, 0), "identifier"},
      {changed(good, 12, 146), "VkFormat 146"},  // BC7_SRGB_BLOCK
      {changed(good, 20, 0), "0 x 8 texels"},
      {changed(good, 24, 0x80000000), "16 x 2147483648 texels"},
      {changed(good, 28, 2), "cube or a volume"},
      {changed(good, 32, 0xffffffff), "4294967295 layers"},
      {changed(good, 36, 6), "cube or a volume"},
      {changed(good, 40, 31), "31 levels"},
      {changed(good, 44, 1), "scheme 1"},
      {changed(good, 48, 0xffffff00), "data format descriptor"},
      {changed(good, 52, 8), "data format descriptor"},
      {changed(good, dfd + 14, 2, 1), "transfer function 2"},  // sRGB
      {changed(good, 60, 0x7fffffff), "key/value data"},
      {changed(good, kvd, 0xffffffff), "key/value data"},
      {changed(good, kvd, 1), "key/value data"},
      {changed(good, 60, kvd_bytes - 3), "key/value data"},
      {changed(good, kvd + 4 + 16, 'u', 1), "\"ru\""},
      {changed(good, 80, good.size()), "level 0 of the KTX2 file is not inside"},
      {changed(good, 80, ~uint64_t{0}, 8), "level 0 of the KTX2 file is not inside"},
      {changed(good, 88, ~uint64_t{0}, 8), "level 0 of the KTX2 file is not inside"},
      {changed(good, 96, 0), "level 0 of the KTX2 file states 0 bytes"},
      {changed(good, 24, 4), "level 0 of the KTX2 file states 256 bytes"},
      {changed(packed, 88, 1), "level 0 of the KTX2 file"},
      {changed(changed(changed(packed, 20, 16384), 24, 16384), 96, uint64_t{2} << 28, 8),
       "which cannot hold"},
  };
  for (const Damage& d : cases) {
    const auto result = read_ktx2(d.file);
    ASSERT_FALSE(result) << d.expected;
    EXPECT_NE(result.error().message.find(d.expected), std::string::npos)
        << result.error().message << " instead of " << d.expected;
    EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);
  }
  EXPECT_FALSE(read_ktx2(good, 100));
  EXPECT_TRUE(read_ktx2(good));
  EXPECT_TRUE(read_ktx2(packed));
}

TEST(Damage, EveryCutAndEveryBitIsAnErrorOrATexture) {
  for (const TextureFormat format : {TextureFormat::kBc1Unorm, TextureFormat::kBc4Unorm,
                                     TextureFormat::kBc5Snorm, TextureFormat::kRgba8Unorm}) {
    const TextureImages t = picture(format, 5, 3, 2, 0);
    for (const Bytes& file : {*write_dds(t), *write_ktx2(t, 0), *write_ktx2(t, 3)}) {
      const auto read = [&](std::span<const std::byte> bytes) {
        const auto result =
            static_cast<char>(file[0]) == 'D' ? read_dds(bytes, 1 << 20) : read_ktx2(bytes, 1 << 20);
        if (!result) EXPECT_FALSE(result.error().message.empty());
      };
      for (size_t cut = 0; cut < file.size(); ++cut) read(std::span(file).first(cut));
      for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
        Bytes damaged = file;
        damaged[bit / 8] ^= static_cast<std::byte>(1 << bit % 8);
        read(damaged);
      }
    }
  }
}

}  // namespace
}  // namespace kiln

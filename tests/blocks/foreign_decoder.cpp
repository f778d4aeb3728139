#include "tests/blocks/foreign_decoder.h"

#include <algorithm>

#include "tests/container/oiio_dds.h"

namespace kiln::test {

std::vector<uint8_t> foreign_bytes(TextureFormat format, const Bytes& blocks) {
  // As many rows of 64 blocks as it takes.
  const size_t size = texture_format(format).bytes, count = blocks.size() / size, rows = (count + 63) / 64;
  Bytes padded = blocks;
  padded.resize(rows * 64 * size);
  const auto file = write_dds({format, 256, static_cast<uint32_t>(4 * rows), {{padded}}});
  const DdsPicture picture = oiio_read_dds(*file);
  EXPECT_EQ(picture.error, "");
  std::vector<uint8_t> out(64 * count);
  if (picture.bytes.size() != 64 * rows * 64) {
    ADD_FAILURE() << picture.bytes.size() << " bytes";
    return out;
  }
  for (size_t b = 0; b < count; ++b)
    for (size_t y = 0; y < 4; ++y)
      std::copy_n(&picture.bytes[4 * (256 * (b / 64 * 4 + y) + b % 64 * 4)], 16, &out[64 * b + 16 * y]);
  return out;
}

}  // namespace kiln::test

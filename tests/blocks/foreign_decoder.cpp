#include "tests/blocks/foreign_decoder.h"

#include <algorithm>

#include "tests/container/oiio_dds.h"

namespace kiln::test {

namespace {

// As many rows of 64 blocks as it takes.
DdsPicture picture_of(TextureFormat format, const Bytes& blocks) {
  const size_t size = texture_format(format).bytes, rows = (blocks.size() / size + 63) / 64;
  Bytes padded = blocks;
  padded.resize(rows * 64 * size);
  const auto file = write_dds({format, 256, static_cast<uint32_t>(4 * rows), {{padded}}});
  DdsPicture picture = oiio_read_dds(*file);
  EXPECT_EQ(picture.error, "");
  return picture;
}

template <class T>
std::vector<T> by_block(const std::vector<T>& rgba, size_t count) {
  std::vector<T> out(64 * count);
  if (rgba.size() != (count + 63) / 64 * 64 * 64) {
    ADD_FAILURE() << rgba.size() << " values";
    return out;
  }
  for (size_t b = 0; b < count; ++b)
    for (size_t y = 0; y < 4; ++y)
      std::copy_n(&rgba[4 * (256 * (b / 64 * 4 + y) + b % 64 * 4)], 16, &out[64 * b + 16 * y]);
  return out;
}

}  // namespace

std::vector<uint8_t> foreign_bytes(TextureFormat format, const Bytes& blocks) {
  return by_block(picture_of(format, blocks).bytes, blocks.size() / texture_format(format).bytes);
}

std::vector<float> foreign_floats(TextureFormat format, const Bytes& blocks) {
  return by_block(picture_of(format, blocks).floats, blocks.size() / texture_format(format).bytes);
}

}  // namespace kiln::test

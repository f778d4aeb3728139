// Three bytes of size, then what zstd shall unpack to exactly that.
#include "common/wire/limits.h"
#include "common/zstd/compress.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_decompress(std::span<const std::byte> data) {
  uint32_t size = 0;
  if (data.size() < 3) return;
  std::memcpy(&size, data.data(), 3);
  size %= kChunkPieceBytes + 1;  // as blocks.cpp holds it
  const auto unpacked = decompress(data.subspan(3), size);
  require_sentence(unpacked);
  if (unpacked) require(unpacked->size() == size, "the stated size, or an error");
}

}  // namespace kiln::fuzz

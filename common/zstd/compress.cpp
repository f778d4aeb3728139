#include "common/zstd/compress.h"

#include <zstd.h>

#include "common/base/check.h"

namespace kiln {

Bytes compress(std::span<const std::byte> data, int level) {
  Bytes packed(ZSTD_compressBound(data.size()));
  const size_t size = ZSTD_compress(packed.data(), packed.size(), data.data(), data.size(), level);
  KILN_CHECK(!ZSTD_isError(size));
  packed.resize(size);
  return packed;
}

Expected<Bytes> decompress(std::span<const std::byte> packed, size_t size) {
  Bytes data(size);
  const size_t got = ZSTD_decompress(data.data(), data.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) || got != size)
    return fail(ErrorKind::kProtocol, "compressed data does not unpack to the stated size");
  return data;
}

}  // namespace kiln

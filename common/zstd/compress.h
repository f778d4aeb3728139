#pragma once

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// One zstd frame. Levels 1 to 19. At level 1, the default, compressing a chunk takes less time than sending
// it uncompressed over a gigabit network.
Bytes compress(std::span<const std::byte> data, int level = 1);
// Exactly `size` bytes, or an error (kProtocol); never allocates more, whatever the data claims.
Expected<Bytes> decompress(std::span<const std::byte> packed, size_t size);
// Upper bound on the bytes that `packed` bytes of zstd decompress to: a block of at most 2^17 bytes takes at
// least 4 (RFC 8878, section 3.1.1.2).
constexpr uint64_t decompressed_bound(uint64_t packed) {
  return (packed / 4 + 1) << 17;
}

}  // namespace kiln

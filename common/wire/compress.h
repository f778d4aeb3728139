#pragma once

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// zstd level 1: a chunk costs less time to pack than a gigabit network to carry it unpacked.
Bytes compress(std::span<const std::byte> data);
// Exactly `size` bytes, or an error (kProtocol); never allocates more, whatever the data claims.
Expected<Bytes> decompress(std::span<const std::byte> packed, size_t size);

}  // namespace kiln

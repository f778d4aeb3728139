// The fixed parts of a KTX2 file (KTX 2.0 specification, section 2), little-endian.
#pragma once

#include <array>
#include <cstdint>

namespace kiln {

constexpr std::array<uint8_t, 12> kKtx2Identifier = {0xab, 'K',  'T',  'X',  ' ',  '2',
                                                     '0',  0xbb, '\r', '\n', 0x1a, '\n'};

struct Ktx2Header {
  std::array<uint8_t, 12> identifier;
  uint32_t vk_format, type_size, width, height, depth, layers, faces, levels, supercompression;
  uint32_t dfd_offset, dfd_bytes, kvd_offset, kvd_bytes;
  uint64_t sgd_offset, sgd_bytes;
};
static_assert(sizeof(Ktx2Header) == 80);

struct Ktx2Level {
  uint64_t offset, bytes, unpacked_bytes;
};

enum : uint32_t { kKtx2None = 0, kKtx2Zstd = 2 };

}  // namespace kiln

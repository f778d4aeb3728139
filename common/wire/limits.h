// What a peer may send. Every bound is checked before memory is taken for what it bounds.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln {

// A peer of another major is refused; within a major, a feature newer than the peer's minor is not used.
constexpr uint8_t kWireMajor = 1, kWireMinor = 2;

constexpr uint32_t kMaxControlBytes = 64u << 10;  // payload of a control message
constexpr uint32_t kMaxDataBytes = 16u << 20;     // payload of a data message
constexpr uint32_t kChunkPieceBytes = 4u << 20;   // of a chunk, uncompressed, in one message
constexpr uint64_t kMaxChunkBytes = uint64_t{16} << 30;
constexpr uint32_t kMaxIdsPerRequest = 1024;  // chunk ids in one request: 32 KiB
constexpr size_t kMaxTextBytes = 4096;        // of any text in a message; longer texts are cut
constexpr size_t kMaxDocumentBytes = 8u
                                     << 20;  // of the JSON in a request or a reply; longer ones are refused

constexpr size_t kChunkWriteBudget = 8u << 20;  // bytes of chunks queued for one peer at a time
constexpr size_t kMaxQueuedBytes = 96u << 20;   // a peer that lets more pile up does not read: closed

constexpr uint32_t kPrefetchUnits = 2;  // units that wait on a worker beside one per thread

}  // namespace kiln

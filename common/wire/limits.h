// Limits on what a peer may send. Each is checked before the memory it bounds is allocated.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace kiln {

// A peer of another version is refused in words.
constexpr uint8_t kWireVersion = 5;

constexpr uint32_t kMaxControlBytes = 64u << 10;  // payload of a control message
constexpr uint32_t kMaxDataBytes = 16u << 20;     // payload of a data message
constexpr uint32_t kChunkPieceBytes = 4u << 20;   // of a chunk, uncompressed, in one message
constexpr uint64_t kMaxChunkBytes = uint64_t{16} << 30;
constexpr uint32_t kMaxIdsPerRequest = 1024;  // chunk ids in one request: 32 KiB
constexpr size_t kMaxDocumentBytes = 8u
                                     << 20;  // of the JSON in a request or a reply; longer ones are refused

constexpr size_t kChunkWriteBudget = 8u << 20;  // bytes of chunks queued for one peer at a time
constexpr size_t kMaxQueuedBytes = 96u << 20;   // a peer that lets more pile up has stopped reading: closed

// Memory for messages that are arriving. Only what has arrived is allocated; beyond the first
// kUnreservedBytes a message reserves its size among all connections of the listener (receive_budget.h).
constexpr uint32_t kUnreservedBytes = 64u << 10;
constexpr size_t kReceiveBytes = 512u << 20;
constexpr size_t kReceiveBytesOfCaller = 128u << 20;  // one address, or one certificate

// Deadlines. A message that began has kMessagePatience and a second for each kSlowestBytes; a written one has
// the same before its peer counts as having stopped reading.
constexpr std::chrono::milliseconds kMessagePatience{60'000};
constexpr uint32_t kSlowestBytes = 32u << 10;
constexpr std::chrono::milliseconds kClientPatience{15 * 60'000};  // a client that says nothing at all

constexpr size_t kMaxClientsOfCaller = 64;        // connections
constexpr uint32_t kMaxReaderBytes = 256u << 10;  // a message of somebody who may only read

constexpr uint32_t kPrefetchUnits = 2;  // units queued on a worker in addition to one per thread

}  // namespace kiln

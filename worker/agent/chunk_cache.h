// Content-addressed chunks, kept in memory across jobs and connections.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "common/wire/messages.h"

namespace kiln {

using ChunkBytes = std::shared_ptr<const Bytes>;  // shared with threads that read or store it

// A partially received chunk.
struct PartialChunk {
  Digest id;
  uint64_t total = 0;
  Bytes bytes;
  std::unique_ptr<Sha256> hash = std::make_unique<Sha256>();
};

class ChunkCache {
 public:
  ChunkBytes find(const Digest& id) const;  // null: not here
  // Returns the chunk completed by this piece, or null. Pieces of one chunk arrive in order, chunks one after
  // another; a chunk whose bytes do not match its id is an error (kProtocol) and is dropped.
  Expected<ChunkBytes> add(const ChunkPiece& piece);
  void put(const Digest& id, ChunkBytes bytes);  // whose SHA-256 was verified to be `id`
  ChunkBytes take(const Digest& id);             // removes and returns it; null: not here
  void forget_partial() { partial_.reset(); }    // its connection is gone
  // Drops chunks not in `needed` if the total exceeds max_bytes.
  void shrink(const std::unordered_set<Digest>& needed, uint64_t max_bytes);
  uint64_t total_bytes() const { return total_; }

 private:
  std::unordered_map<Digest, ChunkBytes> chunks_;
  std::optional<PartialChunk> partial_;
  uint64_t total_ = 0;
};

}  // namespace kiln

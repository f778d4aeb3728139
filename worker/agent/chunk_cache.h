// Chunks by content, kept in memory across jobs and connections.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "common/wire/messages.h"

namespace kiln {

using ChunkBytes = std::shared_ptr<const Bytes>;  // shared with threads that read or store it

// A chunk of which pieces have come.
struct PartialChunk {
  Digest id;
  uint64_t total = 0;
  Bytes bytes;
  std::unique_ptr<Sha256> hash = std::make_unique<Sha256>();
};

class ChunkCache {
 public:
  ChunkBytes find(const Digest& id) const;  // null: not here
  // The chunk that this piece completes, or null. Pieces of one chunk come in order, chunks one after
  // another; a chunk whose bytes do not have its id is an error (kProtocol) and is not kept.
  Expected<ChunkBytes> add(const ChunkPiece& piece);
  void put(const Digest& id, ChunkBytes bytes);  // whose SHA-256 was seen to be `id`
  ChunkBytes take(const Digest& id);             // out of here; null: it was not
  void forget_partial() { partial_.reset(); }    // the connection that was sending it is gone
  // Drops what is not in `needed` if all together take more than max_bytes.
  void shrink(const std::unordered_set<Digest>& needed, uint64_t max_bytes);
  uint64_t total_bytes() const { return total_; }

 private:
  std::unordered_map<Digest, ChunkBytes> chunks_;
  std::optional<PartialChunk> partial_;
  uint64_t total_ = 0;
};

}  // namespace kiln

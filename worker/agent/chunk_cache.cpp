#include "worker/agent/chunk_cache.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/wire/limits.h"

namespace kiln {

ChunkBytes ChunkCache::find(const Digest& id) const {
  const auto it = chunks_.find(id);
  return it == chunks_.end() ? nullptr : it->second;
}

Expected<ChunkBytes> ChunkCache::add(const ChunkPiece& piece) {
  if (piece.offset == 0) {
    partial_.emplace();
    partial_->id = piece.id;
    partial_->total = piece.total;
    // Allocate as pieces arrive, so that claiming gigabytes costs nothing.
    partial_->bytes.reserve(std::min<uint64_t>(piece.total, uint64_t{8} * kChunkPieceBytes));
  }
  if (!partial_ || partial_->id != piece.id || partial_->total != piece.total ||
      partial_->bytes.size() != piece.offset)
    return fail(ErrorKind::kProtocol, text("a piece of chunk {} is out of order", piece.id.hex()));
  partial_->hash->add(piece.bytes);
  partial_->bytes.insert(partial_->bytes.end(), piece.bytes.begin(), piece.bytes.end());
  if (partial_->bytes.size() < partial_->total) {
    if (piece.bytes.empty()) return fail(ErrorKind::kProtocol, "an empty piece of a chunk");
    return ChunkBytes{};
  }
  PartialChunk done = std::move(*partial_);
  partial_.reset();
  if (done.hash->finish() != done.id)
    return fail(ErrorKind::kProtocol, text("chunk {} arrived with other bytes", done.id.hex()));
  auto bytes = std::make_shared<const Bytes>(std::move(done.bytes));
  put(done.id, bytes);
  return bytes;
}

void ChunkCache::put(const Digest& id, ChunkBytes bytes) {
  const size_t size = bytes->size();
  if (chunks_.emplace(id, std::move(bytes)).second) total_ += size;
}

ChunkBytes ChunkCache::take(const Digest& id) {
  const auto it = chunks_.find(id);
  if (it == chunks_.end()) return nullptr;
  ChunkBytes bytes = std::move(it->second);
  chunks_.erase(it);
  total_ -= bytes->size();
  return bytes;
}

void ChunkCache::shrink(const std::unordered_set<Digest>& needed, uint64_t max_bytes) {
  if (total_ <= max_bytes) return;
  std::erase_if(chunks_, [&](const auto& chunk) {
    if (needed.count(chunk.first)) return false;
    total_ -= chunk.second->size();
    return true;
  });
}

}  // namespace kiln

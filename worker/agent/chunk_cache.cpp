#include "worker/agent/chunk_cache.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/wire/limits.h"

namespace kiln {

const Bytes* ChunkCache::find(const Digest& id) const {
  const auto it = chunks_.find(id);
  return it == chunks_.end() ? nullptr : &it->second;
}

Expected<bool> ChunkCache::add(const ChunkPiece& piece) {
  if (piece.offset == 0) {
    partial_.emplace();
    partial_->id = piece.id;
    partial_->total = piece.total;
    // A claim of gigabytes costs memory only as they arrive.
    partial_->bytes.reserve(std::min<uint64_t>(piece.total, uint64_t{8} * kChunkPieceBytes));
  }
  if (!partial_ || partial_->id != piece.id || partial_->total != piece.total ||
      partial_->bytes.size() != piece.offset)
    return fail(ErrorKind::kProtocol, text("a piece of chunk {} is out of order", piece.id.hex()));
  partial_->hash->add(piece.bytes);
  partial_->bytes.insert(partial_->bytes.end(), piece.bytes.begin(), piece.bytes.end());
  if (partial_->bytes.size() < partial_->total) {
    if (piece.bytes.empty()) return fail(ErrorKind::kProtocol, "an empty piece of a chunk");
    return false;
  }
  Partial done = std::move(*partial_);
  partial_.reset();
  if (done.hash->finish() != done.id)
    return fail(ErrorKind::kProtocol, text("chunk {} arrived with other bytes", done.id.hex()));
  const size_t size = done.bytes.size();
  if (chunks_.emplace(done.id, std::move(done.bytes)).second) total_ += size;
  return true;
}

void ChunkCache::shrink(const std::unordered_set<Digest>& needed, uint64_t max_bytes) {
  if (total_ <= max_bytes) return;
  std::erase_if(chunks_, [&](const auto& chunk) {
    if (needed.count(chunk.first)) return false;
    total_ -= chunk.second.size();
    return true;
  });
}

}  // namespace kiln

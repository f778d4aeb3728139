#include "coordinator/service/client_files.h"

#include "common/base/format.h"

namespace kiln {

ClientFiles::~ClientFiles() {
  for (const auto& [digest, upload] : uploads_) blobs_.abandon(digest);
}

Expected<uint64_t> ClientFiles::begin_upload(const Digest& digest, uint64_t size) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(digest);
  if (it == uploads_.end()) {
    if (uploads_.size() == kMaxUploads)
      return fail(ErrorKind::kUsage, text("at most {} uploads at a time: end one first", kMaxUploads));
    KILN_TRY(const uint64_t have, blobs_.begin(digest, size));
    if (!blobs_.has(digest)) uploads_[digest] = {size, have, std::nullopt};
    return have;
  }
  Upload& upload = it->second;
  if (upload.size != size)
    return fail(ErrorKind::kInvalidInput, text("'size' is {} and was {}", size, upload.size));
  if (upload.error) {  // told once; whoever tries again begins anew, with what the disk has
    const Error error = *upload.error;
    uploads_.erase(it);
    blobs_.abandon(digest);
    return tl::unexpected<Error>(error);
  }
  return upload.have;
}

void ClientFiles::append(const ChunkPiece& piece) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(piece.id);
  if (it == uploads_.end() || it->second.error) return;
  Upload& upload = it->second;
  if (const Status s = blobs_.append(piece.id, piece.offset, piece.bytes); !s)
    upload.error = s.error();
  else
    upload.have = std::max(upload.have, piece.offset + piece.bytes.size());
}

void ClientFiles::refuse_piece(const Digest& digest, const std::string& why) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(digest);
  if (it != uploads_.end() && !it->second.error) it->second.error = Error{ErrorKind::kUnavailable, why};
}

Status ClientFiles::finish_upload(const Digest& digest, int64_t now_ms) {
  {
    const std::lock_guard lock(mutex_);
    const auto it = uploads_.find(digest);
    if (it == uploads_.end()) {
      if (blobs_.use(digest, now_ms)) return {};
      return fail(ErrorKind::kInvalidInput, text("no upload of {} was begun", digest.hex()));
    }
    if (it->second.error) {
      const Error error = *std::exchange(it->second.error, std::nullopt);
      return tl::unexpected<Error>(error);
    }
  }
  const Status done = blobs_.finish(digest, now_ms);
  if (done || done.error().kind == ErrorKind::kInvalidInput) {
    const std::lock_guard lock(mutex_);
    uploads_.erase(digest);
  }
  return done;
}

Status ClientFiles::allow_download(const Digest& digest, uint64_t from) {
  const std::lock_guard lock(mutex_);
  if (downloads_.size() >= kMaxDownloads && !downloads_.count(digest))
    return fail(ErrorKind::kUsage, text("at most {} files may wait to be sent", kMaxDownloads));
  downloads_[digest] = from;
  return {};
}

std::optional<uint64_t> ClientFiles::take_download(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto it = downloads_.find(digest);
  if (it == downloads_.end()) return std::nullopt;
  const uint64_t from = it->second;
  downloads_.erase(it);
  return from;
}

}  // namespace kiln

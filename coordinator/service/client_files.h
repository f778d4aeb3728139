// One client's uploads and permitted downloads. Callable from any thread.
#pragma once

#include <map>
#include <mutex>
#include <optional>

#include "common/wire/messages.h"
#include "coordinator/farm/queue/blobs.h"

namespace kiln {

class ClientFiles {
 public:
  explicit ClientFiles(BlobStore& blobs) : blobs_(blobs) {}
  ~ClientFiles();  // data of unfinished uploads is kept for another try

  // Starts an upload, or reports the progress of a started one and, once, the error of a piece.
  Expected<uint64_t> begin_upload(const Digest& digest, uint64_t size);
  void append(const ChunkPiece& piece);
  void refuse_piece(const Digest& digest, const std::string& why);
  Status finish_upload(const Digest& digest, int64_t now_ms);

  Status allow_download(const Digest& digest, uint64_t from);
  std::optional<uint64_t> take_download(const Digest& digest);  // start offset; nothing if not allowed

 private:
  static constexpr size_t kMaxUploads = 16, kMaxDownloads = 4096;
  struct Upload {
    uint64_t size = 0, have = 0;
    std::optional<Error> error;
  };
  BlobStore& blobs_;
  std::mutex mutex_;
  std::map<Digest, Upload> uploads_;
  std::map<Digest, uint64_t> downloads_;
};

}  // namespace kiln

// Files by what is in them: folder/ab/abcdef... named by the SHA-256 of their bytes, so that a scene that
// comes twice is kept once. A blob appears complete, verified and synced, or not at all.
//
// Every function may be called from any thread; finish() and put_file() read the whole file and let the
// others go on.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>

#include "common/base/hash.h"
#include "common/base/status.h"
#include "coordinator/farm/queue/disk_calls.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct BlobOptions {
  uint64_t blob_bytes = uint64_t{16} << 30;  // of one blob, at most
  uint64_t keep_free = uint64_t{1} << 30;    // of the disk: an upload that would take it is refused
  DiskCalls* faults = nullptr;               // tests; nullptr: the real calls
};

class BlobStore {
 public:
  // Makes the folder. One object per folder: the lock of the store keeps other processes out.
  static Expected<std::unique_ptr<BlobStore>> open(const std::filesystem::path& folder,
                                                   const BlobOptions& options);

  bool has(const Digest& digest) const;
  std::filesystem::path path(const Digest& digest) const;  // where it is or would be
  Expected<uint64_t> size(const Digest& digest) const;     // kInvalidInput if it is not there
  // Says that somebody needs it now: collect() leaves it for its keep_ms from then on. False if it is not
  // there.
  bool use(const Digest& digest, int64_t now_ms);

  // An upload: begin, append until all is there, finish. begin() gives the bytes that are there already, from
  // an upload that broke off; `size` if the blob is. Fails before anything is written on more bytes than are
  // allowed (kInvalidInput) or than the disk has (kNoSpace), counting what other uploads still want.
  Expected<uint64_t> begin(const Digest& digest, uint64_t size);
  // Bytes that are there already are passed over. Fails (kInvalidInput) on a gap and on more than was said.
  Status append(const Digest& digest, uint64_t offset, std::span<const std::byte> data);
  // Verifies, syncs and names it. On bytes that do not have the digest all of them are removed
  // (kInvalidInput).
  Status finish(const Digest& digest, int64_t now_ms);
  // The uploader went away: what came stays for a later begin(), until collect() finds it too old.
  void abandon(const Digest& digest);

  // A copy of a file, hashed on its way in. Changed while it is read, it is what was read.
  Expected<FileRecord> put_file(const std::filesystem::path& file, int64_t now_ms);

  struct Collected {
    uint64_t blobs = 0, bytes = 0;
    uint64_t kept = 0;
  };
  // Removes what is not in `referenced`, is no upload under way, and was last used before now_ms - keep_ms.
  // Who asks has() and submits later must do so within keep_ms, or call use() again.
  Collected collect(const std::set<Digest>& referenced, int64_t now_ms, int64_t keep_ms);

 private:
  struct Upload {
    uint64_t size = 0, have = 0;
    uint32_t users = 0;
    bool finishing = false;
  };
  BlobStore(std::filesystem::path folder, const BlobOptions& options);
  std::filesystem::path part_path(const Digest& digest) const;
  Status check_room(uint64_t size, uint64_t have) const;  // mutex_ held
  Status publish(const Digest& digest, int64_t now_ms);

  const std::filesystem::path folder_;
  const BlobOptions options_;
  DiskCalls& disk_;
  mutable std::mutex mutex_;
  std::map<Digest, Upload> uploads_;
  uint64_t next_copy_ = 0;
};

// The digests that records refer to, inputs and results.
std::set<Digest> referenced_blobs(const std::vector<JobRecord>& jobs);

}  // namespace kiln

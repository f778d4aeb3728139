// Content-addressed files: folder/ab/abcdef... named by the SHA-256 of their bytes, so that a scene submitted
// twice is stored once. A blob appears complete, verified and synced, or not at all.
//
// Thread-safe. finish() and put_file() read the whole file without blocking other calls.
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
  uint64_t blob_bytes = uint64_t{16} << 30;  // size limit of one blob
  uint64_t keep_free = uint64_t{1} << 30;  // free disk space to keep: an upload that would use it is refused
  DiskCalls* faults = nullptr;             // tests; nullptr: the real calls
};

class BlobStore {
 public:
  // Creates the folder. One object per folder: the store's lock keeps other processes out.
  static Expected<std::unique_ptr<BlobStore>> open(const std::filesystem::path& folder,
                                                   const BlobOptions& options);

  bool has(const Digest& digest) const;
  std::filesystem::path path(const Digest& digest) const;  // where it is or would be
  Expected<uint64_t> size(const Digest& digest) const;     // kInvalidInput if it is not there
  // Marks the blob as used now: collect() keeps it for keep_ms from then on. Returns false if it does not
  // exist.
  bool use(const Digest& digest, int64_t now_ms);

  // An upload: begin, append until complete, finish. begin() returns the bytes already present from an
  // interrupted upload, or `size` if the blob exists. Fails before writing if the size exceeds the limit
  // (kInvalidInput) or the free space (kNoSpace), counting the rest of other uploads.
  Expected<uint64_t> begin(const Digest& digest, uint64_t size);
  // Skips bytes already present. Fails (kInvalidInput) on a gap and on more bytes than announced.
  Status append(const Digest& digest, uint64_t offset, std::span<const std::byte> data);
  // Verifies, syncs and names it. Removes all bytes and fails (kInvalidInput) if the digest differs.
  Status finish(const Digest& digest, int64_t now_ms);
  // The uploader disconnected: its bytes stay for a later begin(), until collect() finds them too old.
  void abandon(const Digest& digest);

  // Copies a file, hashing while reading. If the file changes meanwhile, the blob is what was read.
  Expected<FileRecord> put_file(const std::filesystem::path& file, int64_t now_ms);

  struct Collected {
    uint64_t blobs = 0, bytes = 0;
    uint64_t kept = 0;
  };
  // Removes blobs that are not in `referenced`, not being uploaded, and last used before now_ms - keep_ms. A
  // caller that checks has() and submits later must do so within keep_ms, or call use() again.
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

// The digests of inputs and results referenced by records.
std::set<Digest> referenced_blobs(const std::vector<JobRecord>& jobs);

}  // namespace kiln

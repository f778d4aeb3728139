// Content-addressed files: folder/ab/abcdef... named by the SHA-256 of their bytes, so that a scene submitted
// twice is stored once. A blob appears complete, verified and synced, or not at all. Disks rot: whoever reads
// one verifies it, and a damaged one is set aside in the folder `damaged` and counts as missing.
//
// Thread-safe. finish(), put_file() and verify() read the whole file without blocking other calls.
#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "common/base/hash.h"
#include "common/base/status.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/queue/disk_calls.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct BlobOptions {
  uint64_t blob_bytes = uint64_t{16} << 30;  // size limit of one blob
  // Free disk space that uploads leave, so that finished jobs can be published whatever is being sent.
  uint64_t keep_free = uint64_t{1} << 30;
  // The same that published files leave: the database and the spool need it.
  uint64_t keep_free_publishing = uint64_t{64} << 20;
  DiskCalls* faults = nullptr;  // tests; nullptr: the real calls
};

enum class BlobState { kIntact, kMissing, kDamaged };

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
  // Reads all of the blob and compares its digest. A damaged one, or one that the disk cannot read, is moved
  // to damaged_path(), with one log line. Fails (kIo) if it cannot be opened.
  // If `pace` ends the reading: kUnavailable.
  Expected<BlobState> verify(const Digest& digest, const ReadPace& pace = {});
  // Totals of verify() since this object was made.
  struct Verified {
    uint64_t bytes = 0, damaged = 0;
  };
  Verified verified() const { return {verified_bytes_, damaged_}; }
  std::filesystem::path damaged_path(const Digest& digest) const;

  // An upload: begin, append until complete, finish. begin() returns the bytes already present from an
  // interrupted upload, or `size` if the blob exists. Fails before writing if the size exceeds the limit
  // (kInvalidInput) or the free space (kNoSpace). Takes no space: bytes do, when they come, and where they
  // would take what `keep_free` leaves, append() fails (kNoSpace). Both remove abandoned uploads first, the
  // oldest first, if that helps.
  Expected<uint64_t> begin(const Digest& digest, uint64_t size);
  // Skips bytes already present. Fails (kInvalidInput) on a gap and on more bytes than announced.
  Status append(const Digest& digest, uint64_t offset, std::span<const std::byte> data);
  // Verifies, syncs and names it. Removes all bytes and fails (kInvalidInput) if the digest differs.
  Status finish(const Digest& digest, int64_t now_ms);
  // The uploader disconnected: its bytes stay for a later begin(), until collect() finds them too old.
  void abandon(const Digest& digest);
  // Removes the bytes of uploads that got none since the last call; they may be begun again. Returns how
  // many.
  size_t drop_idle();

  // Copies a file, hashing while reading. If the file changes meanwhile, the blob is what was read. A damaged
  // blob with the same digest is replaced.
  Expected<FileRecord> put_file(const std::filesystem::path& file, int64_t now_ms);

  struct Collected {
    uint64_t blobs = 0, bytes = 0;
    uint64_t kept = 0;
  };
  // Removes blobs that are not in `referenced`, not being uploaded, and last used before now_ms - keep_ms;
  // and damaged ones a month after they were set aside. A caller that checks has() and submits later must do
  // so within keep_ms, or call use() again.
  Collected collect(const std::set<Digest>& referenced, int64_t now_ms, int64_t keep_ms);

 private:
  struct Upload {
    uint64_t size = 0, have = 0;
    uint32_t users = 0;
    bool finishing = false;
    bool moved = true;     // got bytes since the last drop_idle()
    bool dropped = false;  // begin() starts anew
  };
  BlobStore(std::filesystem::path folder, const BlobOptions& options);
  std::filesystem::path part_path(const Digest& digest) const;
  Expected<uint64_t> start(const Digest& digest, uint64_t size);  // mutex_ held
  // Fails (kNoSpace) unless `keep` stays free beside `bytes` more. mutex_ held.
  Status make_room(uint64_t bytes, uint64_t keep);
  Expected<uint64_t> free_bytes() const;
  void give_up_parts(uint64_t wanted);  // removes abandoned uploads until that much is free
  void collect_damaged(int64_t now_ms);
  Status name(const std::filesystem::path& file, const std::filesystem::path& whole);  // renames it
  Status publish(const Digest& digest, int64_t now_ms);

  const std::filesystem::path folder_;
  const BlobOptions options_;
  DiskCalls& disk_;
  mutable std::mutex mutex_;
  std::map<Digest, Upload> uploads_;
  uint64_t next_copy_ = 0;
  std::atomic<uint64_t> verified_bytes_{0}, damaged_{0};
};

// The digests of inputs and results referenced by records.
std::set<Digest> referenced_blobs(const std::vector<JobRecord>& jobs);

}  // namespace kiln

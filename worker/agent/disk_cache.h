// Content-addressed chunks on disk, so that a restarted worker, or another on the same machine, need not
// fetch them again. Several processes may share a folder without locks: a file's name is the SHA-256 of its
// bytes, it appears by rename, and it is verified on every read. Failures here never fail the bake: a chunk
// that cannot be stored is fetched again.
#pragma once

#include <filesystem>
#include <memory>

#include "worker/agent/chunk_cache.h"

namespace kiln {

class DiskCache {
 public:
  // Creates the folder (mode 0700). Null, with a warning in the log, if it cannot be written.
  static std::unique_ptr<DiskCache> open(const std::filesystem::path& folder, uint64_t max_bytes);

  // Call read and write from one thread at a time. Null: not here. Removes a damaged file.
  ChunkBytes read(const Digest& id);
  // A full or failing disk turns writing off, with a warning. Removes the least recently used files when the
  // total exceeds max_bytes (checked after every max_bytes / 16 written by this process).
  void write(const Digest& id, const Bytes& bytes);

  // FOLDER/replay/JOB-UNIT.json, job as 16 hexadecimal digits: input of `--replay`. Old files are removed.
  std::filesystem::path replay_file(uint64_t job, uint64_t unit) const;
  void shrink_replays() const;

 private:
  DiskCache(std::filesystem::path folder, uint64_t max_bytes)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}
  std::filesystem::path chunk_file(const Digest& id) const;
  void turn_off(const std::string& reason);
  void shrink();

  std::filesystem::path folder_;
  uint64_t max_bytes_;
  uint64_t unseen_ = 0;   // bytes written since the folder was last scanned
  uint64_t counter_ = 0;  // of temporary files
  bool writing_ = true;
};

}  // namespace kiln

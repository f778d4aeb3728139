// A disk under the store's spool that obeys a seed. What was written and not synced may be gone after a power
// cut, 64 bytes at a time; a full or read-only disk refuses; a lying one says that it synced.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <set>

#include "coordinator/farm/queue/disk_calls.h"

namespace kiln::sim {

enum class DiskMood {
  kGood,
  kFull,      // a write ends in the middle with ENOSPC
  kReadOnly,  // EROFS
  kDying,     // accepts writes and fails to sync: the power is about to go
};

class SimDisk final : public DiskCalls {
 public:
  explicit SimDisk(uint64_t seed) : seed_(seed) {}
  void set_mood(DiskMood mood) { mood_ = mood; }
  DiskMood mood() const { return mood_; }
  void lie(bool on) { lies_ = on; }
  // With no file open. Decides about every block that is not synced. Returns how many are lost.
  size_t power_cut();
  // Flips a bit of a spool file, by chance; false if there is none.
  static bool rot(const std::filesystem::path& folder, uint64_t random);

  ssize_t write_at(int file, const void* data, size_t size, off_t offset) override;
  int sync(int file) override;
  int truncate(int file, off_t size) override;

 private:
  const uint64_t seed_;
  std::mutex mutex_;  // the store's thread writes
  DiskMood mood_ = DiskMood::kGood;
  bool lies_ = false;
  uint64_t cuts_ = 0;
  std::map<std::string, std::set<uint64_t>> unsynced_;  // blocks by path
  std::map<std::string, off_t> durable_;                // bytes by path: files grow at their end only
};

}  // namespace kiln::sim

#include "tests/agent_sim/sim_disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/hash.h"

namespace kiln::sim {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kBlock = 64;

std::string path_of(int file) {
  std::error_code code;
  return fs::read_symlink(text("/proc/self/fd/{}", file), code).string();
}

}  // namespace

ssize_t SimDisk::write_at(int file, const void* data, size_t size, off_t offset) {
  const std::lock_guard lock(mutex_);
  if (mood_ == DiskMood::kReadOnly) {
    errno = EROFS;
    return -1;
  }
  const bool full = mood_ == DiskMood::kFull;
  const size_t taken = full ? size / 2 : size;
  const ssize_t put = DiskCalls::write_at(file, data, taken, offset);
  if (put > 0)
    for (uint64_t b = static_cast<uint64_t>(offset) / kBlock;
         b * kBlock < static_cast<uint64_t>(offset) + static_cast<uint64_t>(put); ++b)
      unsynced_[path_of(file)].insert(b);
  if (!full) return put;
  errno = ENOSPC;
  return -1;
}

int SimDisk::sync(int file) {
  const std::lock_guard lock(mutex_);
  if (mood_ != DiskMood::kGood) {
    errno = mood_ == DiskMood::kDying ? EIO : ENOSPC;
    return -1;
  }
  if (lies_) return 0;
  const std::string path = path_of(file);
  unsynced_.erase(path);
  durable_[path] = ::lseek(file, 0, SEEK_END);
  return 0;
}

int SimDisk::truncate(int file, off_t size) {
  const std::lock_guard lock(mutex_);
  if (mood_ == DiskMood::kGood) return DiskCalls::truncate(file, size);
  errno = EIO;
  return -1;
}

// A block's fate depends on the seed and its place alone, not on how writes were grouped.
size_t SimDisk::power_cut() {
  const std::lock_guard lock(mutex_);
  size_t lost = 0;
  ++cuts_;
  for (const auto& [path, blocks] : unsynced_) {
    const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (file < 0) continue;  // removed since
    const off_t end = ::lseek(file, 0, SEEK_END);
    for (const uint64_t block : blocks) {
      const std::string name = text("{} {} {} {}", seed_, cuts_, fs::path(path).filename().string(), block);
      const off_t at = std::max(static_cast<off_t>(block * kBlock), durable_[path]);
      if (at >= end || xxh3(bytes_of(name)) % 3 != 0) continue;
      const std::array<char, kBlock> zeros{};
      const size_t size = static_cast<size_t>(std::min(end, static_cast<off_t>((block + 1) * kBlock)) - at);
      KILN_CHECK(::pwrite(file, zeros.data(), size, at) == static_cast<ssize_t>(size));
      ++lost;
    }
    ::close(file);
  }
  unsynced_.clear();
  mood_ = DiskMood::kGood;
  return lost;
}

bool SimDisk::rot(const fs::path& folder, uint64_t random) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".spool" && entry.file_size() > 0) files.push_back(entry.path());
  if (files.empty()) return false;
  std::sort(files.begin(), files.end());
  const fs::path& path = files[random % files.size()];
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  const off_t at = static_cast<off_t>((random >> 8) % fs::file_size(path));
  unsigned char byte = 0;
  KILN_CHECK(file >= 0 && ::pread(file, &byte, 1, at) == 1);
  byte ^= static_cast<unsigned char>(1u << (random >> 5) % 8);
  KILN_CHECK(::pwrite(file, &byte, 1, at) == 1);
  ::close(file);
  return true;
}

}  // namespace kiln::sim

#include "worker/agent/disk_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <tuple>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/limits.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr auto kAbandoned = std::chrono::hours(1);  // age at which a temporary file counts as abandoned
constexpr size_t kMaxReplays = 100;

bool write_all(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(fd, bytes.data(), bytes.size());
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(put));
  }
  return true;
}

struct StoredFile {
  fs::file_time_type used;
  fs::path path;
  uint64_t bytes;
};

// Another process may remove files meanwhile: errors mean "not there".
std::vector<StoredFile> stored_files(const fs::path& folder) {
  std::vector<StoredFile> files;
  std::error_code code;
  for (fs::recursive_directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    std::error_code gone;
    if (!it->is_regular_file(gone)) continue;
    const uint64_t bytes = it->file_size(gone);
    const auto used = it->last_write_time(gone);
    if (!gone) files.push_back({used, it->path(), bytes});
  }
  std::sort(files.begin(), files.end(), [](const StoredFile& a, const StoredFile& b) {
    return std::tie(a.used, a.path) < std::tie(b.used, b.path);
  });
  return files;
}

}  // namespace

std::unique_ptr<DiskCache> DiskCache::open(const fs::path& folder, uint64_t max_bytes) {
  std::error_code code;
  const bool is_new = !fs::exists(folder, code);
  for (const char* part : {"chunks", "replay"})
    if (!code) fs::create_directories(folder / part, code);
  if (!code && is_new) fs::permissions(folder, fs::perms::owner_all, code);
  if (!code && ::access((folder / "chunks").c_str(), R_OK | W_OK | X_OK) != 0)
    code = std::error_code(errno, std::generic_category());
  if (code) {
    log_warning(
        text("no cache in {}: {}. Scenes are fetched again each time; --cache DIR names another folder",
             folder.string(), code.message()));
    return nullptr;
  }
  std::unique_ptr<DiskCache> cache(new DiskCache(folder, max_bytes));
  cache->shrink();
  return cache;
}

fs::path DiskCache::chunk_file(const Digest& id) const {
  const std::string name = id.hex();
  return folder_ / "chunks" / name.substr(0, 2) / name;
}

ChunkBytes DiskCache::read(const Digest& id) {
  const fs::path path = chunk_file(id);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return nullptr;
  auto bytes = read_file(path, kMaxChunkBytes);
  if (!bytes) return nullptr;  // another process removed it, or the disk fails: fetch it
  if (sha256(*bytes) != id) {
    log_warning(text("{} is damaged and was removed; is the disk healthy?", path.string()));
    fs::remove(path, ignored);
    return nullptr;
  }
  ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // used now
  return std::make_shared<const Bytes>(std::move(*bytes));
}

void DiskCache::write(const Digest& id, const Bytes& bytes) {
  const fs::path path = chunk_file(id);
  std::error_code ignored;
  if (!writing_ || bytes.size() > max_bytes_ || fs::exists(path, ignored)) return;
  fs::create_directories(path.parent_path(), ignored);
  const fs::path temporary = path.parent_path() / text(".{}.{}.{}", id.hex(), ::getpid(), counter_++);
  // No sync: after a power cut a file may hold other bytes, which the next read detects.
  const int fd = ::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
  bool stored = fd >= 0 && write_all(fd, bytes);
  int code = errno;
  if (fd >= 0 && ::close(fd) != 0 && stored) stored = false, code = errno;
  if (stored && ::rename(temporary.c_str(), path.c_str()) != 0) stored = false, code = errno;
  if (!stored) {
    fs::remove(temporary, ignored);
    return turn_off(std::strerror(code));
  }
  unseen_ += bytes.size();
  if (unseen_ > max_bytes_ / 16) shrink();
}

void DiskCache::turn_off(const std::string& reason) {
  writing_ = false;
  log_warning(
      text("the cache in {} stores no more chunks until this worker restarts: {}", folder_.string(), reason));
}

void DiskCache::shrink() {
  unseen_ = 0;
  std::vector<StoredFile> files = stored_files(folder_ / "chunks");
  uint64_t total = 0;
  for (const StoredFile& file : files) total += file.bytes;
  const bool too_large = total > max_bytes_;
  const uint64_t wanted =
      max_bytes_ - max_bytes_ / 8;  // free some extra room, or every chunk would trigger a scan
  const auto now = fs::file_time_type::clock::now();
  std::error_code ignored;
  for (const StoredFile& file : files) {
    const bool temporary = file.path.filename().string().front() == '.';
    if (temporary ? now - file.used < kAbandoned : !too_large || total <= wanted) continue;
    if (fs::remove(file.path, ignored)) total -= file.bytes;
  }
}

fs::path DiskCache::replay_file(uint64_t job, uint64_t unit) const {
  return folder_ / "replay" / text("{:016x}-{}.json", job, unit);
}

void DiskCache::shrink_replays() const {
  const std::vector<StoredFile> files = stored_files(folder_ / "replay");
  std::error_code ignored;
  for (size_t i = 0; i + kMaxReplays < files.size(); ++i) fs::remove(files[i].path, ignored);
}

}  // namespace kiln

#include "coordinator/farm/queue/blobs.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

#include "common/base/format.h"
#include "coordinator/farm/queue/blob_files.h"

namespace kiln {
namespace fs = std::filesystem;

BlobStore::BlobStore(fs::path folder, const BlobOptions& options)
    : folder_(std::move(folder)),
      options_(options),
      disk_(options.faults ? *options.faults : real_disk_calls()) {}

Expected<std::unique_ptr<BlobStore>> BlobStore::open(const fs::path& folder, const BlobOptions& options) {
  KILN_TRY_STATUS(make_folder(real_disk_calls(), folder));
  // Copies interrupted by the end of the last process cannot be resumed.
  for (const fs::path& file : list_folder(folder)) {
    std::error_code ignored;
    if (file.extension() == kCopyEnding) fs::remove(file, ignored);
  }
  return std::unique_ptr<BlobStore>(new BlobStore(folder, options));
}

fs::path BlobStore::path(const Digest& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex;
}

fs::path BlobStore::part_path(const Digest& digest) const {
  return path(digest).string() + kPartEnding;
}

bool BlobStore::has(const Digest& digest) const {
  std::error_code code;
  return fs::is_regular_file(path(digest), code);
}

Expected<uint64_t> BlobStore::size(const Digest& digest) const {
  std::error_code code;
  const uint64_t size = fs::file_size(path(digest), code);
  if (code) return fail(ErrorKind::kInvalidInput, text("there is no blob {}", digest.hex()));
  return size;
}

bool BlobStore::use(const Digest& digest, int64_t now_ms) {
  const std::lock_guard lock(mutex_);
  return set_last_use(path(digest), now_ms);
}

Status BlobStore::check_room(uint64_t size, uint64_t have) const {
  if (size > options_.blob_bytes)
    return fail(ErrorKind::kInvalidInput,
                text("a file of {} bytes: {} are allowed", size, options_.blob_bytes));
  uint64_t wanted = size - std::min(have, size);
  for (const auto& [digest, upload] : uploads_) wanted += upload.size - upload.have;
  std::error_code code;
  const fs::space_info space = fs::space(folder_, code);
  if (code) return system_error("ask for the free space of", folder_, code);
  if (wanted > space.available || space.available - wanted < options_.keep_free)
    return fail(
        ErrorKind::kNoSpace,
        text("{} has {} MiB free, {} MiB of them are to stay free, and uploads need {} MiB: free some space",
             folder_.string(), space.available >> 20, options_.keep_free >> 20, (wanted >> 20) + 1));
  return {};
}

Expected<uint64_t> BlobStore::begin(const Digest& digest, uint64_t size) {
  const std::lock_guard lock(mutex_);
  std::error_code code;
  if (const uint64_t there = fs::file_size(path(digest), code); !code) {
    if (there == size) return size;
    return fail(ErrorKind::kInvalidInput,
                text("the file with digest {} has {} bytes, not {}", digest.hex(), there, size));
  }
  const auto open = uploads_.find(digest);
  if (open != uploads_.end()) {
    if (open->second.size != size)
      return fail(ErrorKind::kInvalidInput,
                  text("the file with digest {} is being sent with {} bytes, not {}", digest.hex(),
                       open->second.size, size));
    ++open->second.users;
    return open->second.have;
  }
  uint64_t have = fs::file_size(part_path(digest), code);
  if (code) have = 0;
  KILN_TRY_STATUS(check_room(size, have));
  KILN_TRY_STATUS(make_folder(disk_, path(digest).parent_path()));
  const OpenFile file(part_path(digest), O_WRONLY | O_CREAT);
  if (!file.is_open()) return system_error("create", file.path());
  if (have > size) {  // of an upload that lied about its size
    if (disk_.truncate(file.number(), 0) != 0) return system_error("shorten", file.path());
    have = 0;
  }
  uploads_[digest] = {size, have, 1, false};
  return have;
}

Status BlobStore::append(const Digest& digest, uint64_t offset, std::span<const std::byte> data) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(digest);
  if (it == uploads_.end() || it->second.finishing) {
    std::error_code code;
    if (it != uploads_.end() || fs::exists(path(digest), code))
      return {};  // another client uploaded it meanwhile
    return fail(ErrorKind::kInvalidInput, text("no upload of {} was begun", digest.hex()));
  }
  Upload& upload = it->second;
  if (offset > upload.have)
    return fail(ErrorKind::kInvalidInput,
                text("an upload of {} goes on at {}, but has {} bytes", digest.hex(), offset, upload.have));
  if (data.size() > upload.size - std::min(offset, upload.size))
    return fail(
        ErrorKind::kInvalidInput,
        text("an upload of {} has more than the {} bytes that were announced", digest.hex(), upload.size));
  const uint64_t known = upload.have - offset;
  if (data.size() <= known) return {};
  data = data.subspan(known);
  const OpenFile file(part_path(digest), O_WRONLY);
  if (!file.is_open()) return system_error("open", file.path());
  // Overwrites bytes after `have` left by a failed write.
  KILN_TRY_STATUS(file.write_at(disk_, data, upload.have));
  upload.have += data.size();
  return {};
}

Status BlobStore::finish(const Digest& digest, int64_t now_ms) {
  {
    const std::lock_guard lock(mutex_);
    const auto it = uploads_.find(digest);
    if (it == uploads_.end() || it->second.finishing) {
      if (set_last_use(path(digest), now_ms)) return {};
      return it != uploads_.end()
                 ? fail(ErrorKind::kUnavailable, text("{} is being verified: ask again", digest.hex()))
                 : fail(ErrorKind::kInvalidInput, text("no upload of {} was begun", digest.hex()));
    }
    if (it->second.have != it->second.size)
      return fail(ErrorKind::kInvalidInput,
                  text("an upload of {} has {} of {} bytes", digest.hex(), it->second.have, it->second.size));
    it->second.finishing = true;
  }
  Status status = publish(digest, now_ms);
  const std::lock_guard lock(mutex_);
  if (status || status.error().kind == ErrorKind::kInvalidInput)
    uploads_.erase(digest);
  else
    uploads_[digest].finishing = false;  // the disk failed: finish() may be retried
  return status;
}

Status BlobStore::publish(const Digest& digest, int64_t now_ms) {
  const fs::path part = part_path(digest), whole = path(digest);
  const OpenFile file(part, O_RDWR);
  if (!file.is_open()) return system_error("open", part);
  KILN_TRY(const HashedFile hashed, hash_file(file));
  if (hashed.digest != digest) {
    std::error_code ignored;
    fs::remove(part, ignored);
    return fail(ErrorKind::kInvalidInput,
                text("what was sent as {} is {}: it was changed on its way, or while it was "
                     "sent; send it again",
                     digest.hex(), hashed.digest.hex()));
  }
  KILN_TRY_STATUS(file.sync(disk_));
  set_last_use(part, now_ms);
  std::error_code code;
  fs::rename(part, whole, code);
  if (code) return system_error("name", whole, code);
  return sync_folder(disk_, whole.parent_path());
}

void BlobStore::abandon(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(digest);
  if (it == uploads_.end() || it->second.finishing) return;
  if (it->second.users > 0) --it->second.users;
  if (it->second.users == 0) uploads_.erase(it);
}

Expected<FileRecord> BlobStore::put_file(const fs::path& source, int64_t now_ms) {
  const OpenFile in(source, O_RDONLY);
  if (!in.is_open()) return system_error("open", source);
  std::error_code code;
  const uint64_t size = fs::file_size(source, code);
  if (code) return system_error("read", source, code);
  fs::path copy;
  {
    const std::lock_guard lock(mutex_);
    KILN_TRY_STATUS(check_room(size, 0));
    copy = folder_ / text("{}{}", next_copy_++, kCopyEnding);
  }
  const auto store = [&]() -> Expected<FileRecord> {
    const OpenFile out(copy, O_WRONLY | O_CREAT | O_TRUNC);
    if (!out.is_open()) return system_error("create", copy);
    KILN_TRY(const HashedFile hashed, copy_file(in, out, disk_, options_.blob_bytes));
    const fs::path whole = path(hashed.digest);
    const FileRecord record{source.filename().string(), hashed.digest, hashed.size};
    if (use(hashed.digest, now_ms)) return record;
    KILN_TRY_STATUS(out.sync(disk_));
    KILN_TRY_STATUS(make_folder(disk_, whole.parent_path()));
    set_last_use(copy, now_ms);
    fs::rename(copy, whole, code);
    if (code) return system_error("name", whole, code);
    KILN_TRY_STATUS(sync_folder(disk_, whole.parent_path()));
    return record;
  };
  auto record = store();
  fs::remove(copy, code);
  return record;
}

}  // namespace kiln

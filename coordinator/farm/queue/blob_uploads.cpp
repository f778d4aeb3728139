// Uploads of blobs, and the disk space that they may take.
#include <fcntl.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/queue/blobs.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

tl::unexpected<Error> dropped_error(const Digest& digest) {
  return fail(
      ErrorKind::kUnavailable,
      text("the upload of {} was dropped, because no bytes came for minutes: send it again", digest.hex()));
}

}  // namespace

Expected<uint64_t> BlobStore::free_bytes() const {
  uint64_t bytes = 0;
  if (disk_.free_bytes(folder_.c_str(), bytes) != 0)
    return system_error("ask for the free space of", folder_);
  return bytes;
}

Status BlobStore::make_room(uint64_t bytes, uint64_t keep) {
  const uint64_t wanted = bytes > UINT64_MAX - keep ? UINT64_MAX : bytes + keep;
  KILN_TRY(uint64_t free, free_bytes());
  if (free >= wanted) return {};
  give_up_parts(wanted);
  KILN_TRY(free, free_bytes());
  if (free >= wanted) return {};
  return fail(
      ErrorKind::kNoSpace,
      text("{} has {} MiB free, {} MiB of them are to stay free, and {} MiB more are needed: free some "
           "space there (`kiln forget` removes results of ended jobs)",
           folder_.string(), free >> 20, keep >> 20, (bytes >> 20) + 1));
}

void BlobStore::give_up_parts(uint64_t wanted) {
  std::vector<std::pair<int64_t, fs::path>> parts;
  for (const fs::path& folder : list_folder(folder_))
    for (const fs::path& file : list_folder(folder)) {
      const auto digest = Digest::from_hex(file.stem().string());
      const auto used = last_use(file);
      if (file.extension() == kPartEnding && digest && used && !uploads_.count(*digest))
        parts.emplace_back(*used, file);
    }
  std::sort(parts.begin(), parts.end());
  for (const auto& [used, file] : parts) {
    const auto free = free_bytes();
    if (!free || *free >= wanted) return;
    std::error_code ignored;
    if (fs::remove(file, ignored))
      log_info(
          text("{}, an upload that nobody goes on with, was removed: its space is needed", file.string()));
  }
}

Expected<uint64_t> BlobStore::start(const Digest& digest, uint64_t size) {
  if (size > options_.blob_bytes)
    return fail(ErrorKind::kInvalidInput,
                text("a file of {} bytes: {} are allowed", size, options_.blob_bytes));
  std::error_code code;
  uint64_t have = fs::file_size(part_path(digest), code);
  if (code) have = 0;
  KILN_TRY_STATUS(make_room(size - std::min(have, size), options_.keep_free));
  KILN_TRY_STATUS(make_folder(disk_, path(digest).parent_path()));
  const OpenFile file(part_path(digest), O_WRONLY | O_CREAT);
  if (!file.is_open()) return system_error("create", file.path());
  have = fs::file_size(part_path(digest), code);  // making room may have removed it
  if (code) return system_error("read", part_path(digest), code);
  if (have <= size) return have;
  // Of an upload that lied about its size.
  if (disk_.truncate(file.number(), 0) != 0) return system_error("shorten", file.path());
  return 0;
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
  if (open == uploads_.end()) {
    KILN_TRY(const uint64_t have, start(digest, size));
    KILN_CHECK(have <= size);
    uploads_[digest] = {size, have, 1};
    return have;
  }
  Upload& upload = open->second;
  if (upload.size != size)
    return fail(ErrorKind::kInvalidInput, text("the file with digest {} is being sent with {} bytes, not {}",
                                               digest.hex(), upload.size, size));
  if (upload.dropped) {
    KILN_TRY(upload.have, start(digest, size));
    upload.dropped = false;
  }
  KILN_CHECK(upload.have <= upload.size);
  ++upload.users;
  return upload.have;
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
  if (upload.dropped) return dropped_error(digest);
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
  KILN_TRY_STATUS(make_room(data.size(), options_.keep_free));
  const OpenFile file(part_path(digest), O_WRONLY);
  if (!file.is_open()) return system_error("open", file.path());
  // Overwrites bytes after `have` left by a failed write.
  KILN_TRY_STATUS(file.write_at(disk_, data, upload.have));
  upload.have += data.size();
  KILN_CHECK(upload.have <= upload.size);
  upload.moved = true;
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
    if (it->second.dropped) return dropped_error(digest);
    if (it->second.have != it->second.size)
      return fail(ErrorKind::kInvalidInput,
                  text("an upload of {} has {} of {} bytes", digest.hex(), it->second.have, it->second.size));
    it->second.finishing = true;
  }
  Status status = publish(digest, now_ms);
  const std::lock_guard lock(mutex_);
  KILN_CHECK(uploads_.count(digest) == 1 && uploads_[digest].finishing);
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
  KILN_TRY_STATUS(name(part, whole));
  return sync_folder(disk_, whole.parent_path());
}

void BlobStore::abandon(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto it = uploads_.find(digest);
  if (it == uploads_.end() || it->second.finishing) return;
  KILN_CHECK(it->second.users > 0);
  if (--it->second.users == 0) uploads_.erase(it);
}

size_t BlobStore::drop_idle() {
  const std::lock_guard lock(mutex_);
  size_t dropped = 0;
  for (auto& [digest, upload] : uploads_) {
    if (upload.finishing || upload.dropped || std::exchange(upload.moved, false)) continue;
    std::error_code ignored;
    fs::remove(part_path(digest), ignored);
    log_info(text("the upload of {} was dropped with {} of {} bytes: no more came", digest.hex(), upload.have,
                  upload.size));
    upload.have = 0;
    upload.dropped = true;
    ++dropped;
  }
  return dropped;
}

}  // namespace kiln

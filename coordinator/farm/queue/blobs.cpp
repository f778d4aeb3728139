#include "coordinator/farm/queue/blobs.h"

#include <fcntl.h>

#include <cerrno>

#include "common/base/format.h"
#include "common/base/log.h"
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

fs::path BlobStore::damaged_path(const Digest& digest) const {
  return folder_ / kDamagedFolder / digest.hex();
}

bool BlobStore::use(const Digest& digest, int64_t now_ms) {
  const std::lock_guard lock(mutex_);
  return set_last_use(path(digest), now_ms);
}

Expected<BlobState> BlobStore::verify(const Digest& digest, const ReadPace& pace) {
  const fs::path whole = path(digest);
  const OpenFile file(whole, O_RDONLY);
  if (!file.is_open()) {
    if (errno == ENOENT) return BlobState::kMissing;
    return system_error("open", whole);
  }
  const auto hashed = hash_file(file, [&](uint64_t bytes) {
    verified_bytes_ += bytes;
    return !pace || pace(bytes);
  });
  if (hashed && hashed->digest == digest) return BlobState::kIntact;
  if (!hashed && hashed.error().kind == ErrorKind::kUnavailable) return tl::unexpected<Error>(hashed.error());
  const std::lock_guard lock(mutex_);
  // Another thread may have replaced it since, or set it aside.
  if (!is_file_at(file, whole)) return BlobState::kDamaged;
  ++damaged_;
  const fs::path aside = damaged_path(digest);
  std::error_code code;
  fs::create_directory(aside.parent_path(), code);
  fs::rename(whole, aside, code);
  if (code)
    fs::remove(whole, code);
  else
    fs::last_write_time(aside, fs::file_time_type::clock::now(), code);  // collect() counts a month from here
  log_warning(text("the blob {} is damaged ({}): it was moved to {}; is the disk healthy?", digest.hex(),
                   hashed ? text("its bytes are those of {}", hashed->digest.hex()) : hashed.error().message,
                   aside.string()));
  return BlobState::kDamaged;
}

// Locked, so that verify() never sets a replacement aside for what it replaced.
Status BlobStore::name(const fs::path& file, const fs::path& whole) {
  const std::lock_guard lock(mutex_);
  std::error_code code;
  fs::rename(file, whole, code);
  if (code) return system_error("name", whole, code);
  return {};
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
    KILN_TRY_STATUS(make_room(size, options_.keep_free_publishing));
    copy = folder_ / text("{}{}", next_copy_++, kCopyEnding);
  }
  if (size > options_.blob_bytes)
    return fail(ErrorKind::kInvalidInput,
                text("{} has {} bytes: {} are allowed", source.string(), size, options_.blob_bytes));
  const auto store = [&]() -> Expected<FileRecord> {
    const OpenFile out(copy, O_WRONLY | O_CREAT | O_TRUNC);
    if (!out.is_open()) return system_error("create", copy);
    KILN_TRY(const HashedFile hashed, copy_file(in, out, disk_, options_.blob_bytes));
    const fs::path whole = path(hashed.digest);
    const FileRecord record{source.filename().string(), hashed.digest, hashed.size};
    if (use(hashed.digest, now_ms)) {
      KILN_TRY(const BlobState state, verify(hashed.digest));
      if (state == BlobState::kIntact) return record;
    }
    KILN_TRY_STATUS(out.sync(disk_));
    KILN_TRY_STATUS(make_folder(disk_, whole.parent_path()));
    set_last_use(copy, now_ms);
    KILN_TRY_STATUS(name(copy, whole));
    KILN_TRY_STATUS(sync_folder(disk_, whole.parent_path()));
    return record;
  };
  auto record = store();
  fs::remove(copy, code);
  return record;
}

}  // namespace kiln

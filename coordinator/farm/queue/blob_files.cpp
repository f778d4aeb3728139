#include "coordinator/farm/queue/blob_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "common/base/bytes.h"
#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr size_t kPiece = size_t{1} << 20;

// Calls take(bytes, offset) for each piece of a file.
template <class Take>
Expected<HashedFile> read_pieces(const OpenFile& file, const Take& take) {
  Sha256 sha;
  HashedFile hashed;
  Bytes piece(kPiece);
  for (;;) {
    const ssize_t got = ::pread(file.number(), piece.data(), piece.size(), static_cast<off_t>(hashed.size));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error("read", file.path());
    if (got == 0) break;
    const std::span<const std::byte> data(piece.data(), static_cast<size_t>(got));
    KILN_TRY_STATUS(take(data, hashed.size));
    sha.add(data);
    hashed.size += data.size();
  }
  hashed.digest = sha.finish();
  return hashed;
}

}  // namespace

Expected<HashedFile> hash_file(const OpenFile& file, const ReadPace& pace) {
  return read_pieces(file, [&](std::span<const std::byte> data, uint64_t) -> Status {
    if (!pace || pace(data.size())) return {};
    return fail(ErrorKind::kUnavailable, text("{} was not read to its end", file.path().string()));
  });
}

Expected<HashedFile> copy_file(const OpenFile& in, const OpenFile& out, DiskCalls& disk, uint64_t most) {
  return read_pieces(in, [&](std::span<const std::byte> data, uint64_t offset) -> Status {
    if (offset + data.size() > most)
      return fail(ErrorKind::kInvalidInput, text("{}: more than {} bytes", in.path().string(), most));
    return out.write_at(disk, data, offset);
  });
}

bool is_file_at(const OpenFile& file, const fs::path& path) {
  struct stat by_file, by_name;
  return ::fstat(file.number(), &by_file) == 0 && ::stat(path.c_str(), &by_name) == 0 &&
         by_file.st_dev == by_name.st_dev && by_file.st_ino == by_name.st_ino;
}

bool set_last_use(const fs::path& path, int64_t now_ms) {
  timespec times[2];
  times[0].tv_nsec = UTIME_OMIT;
  times[1].tv_sec = now_ms / 1000;
  times[1].tv_nsec = now_ms % 1000 * 1000000;
  return ::utimensat(AT_FDCWD, path.c_str(), times, 0) == 0;
}

std::optional<int64_t> last_use(const fs::path& path) {
  struct stat status;
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return int64_t{status.st_mtim.tv_sec} * 1000 + status.st_mtim.tv_nsec / 1000000;
}

}  // namespace kiln

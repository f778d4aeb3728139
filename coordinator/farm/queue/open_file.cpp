#include "coordinator/farm/queue/open_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;

tl::unexpected<Error> system_error(std::string_view doing, const fs::path& path) {
  return system_error(doing, path, std::error_code(errno, std::generic_category()));
}

tl::unexpected<Error> system_error(std::string_view doing, const fs::path& path,
                                   const std::error_code& code) {
  const bool full = code.value() == ENOSPC || code.value() == EDQUOT;
  return fail(full ? ErrorKind::kNoSpace : ErrorKind::kIo,
              text("cannot {} {}: {}", doing, path.string(), std::strerror(code.value())));
}

OpenFile::OpenFile(fs::path path, int flags)
    : path_(std::move(path)), file_(::open(path_.c_str(), flags | O_CLOEXEC, 0600)) {}

OpenFile::OpenFile(OpenFile&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
  if (this != &other) {
    close();
    path_ = std::move(other.path_);
    file_ = std::exchange(other.file_, -1);
  }
  return *this;
}

void OpenFile::close() {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

Status OpenFile::write_at(DiskCalls& disk, std::span<const std::byte> data, uint64_t offset) const {
  KILN_CHECK(is_open());
  while (!data.empty()) {
    const ssize_t put = disk.write_at(file_, data.data(), data.size(), static_cast<off_t>(offset));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return system_error("write", path_);
    data = data.subspan(static_cast<size_t>(put));
    offset += static_cast<uint64_t>(put);
  }
  return {};
}

Status OpenFile::sync(DiskCalls& disk) const {
  KILN_CHECK(is_open());
  if (disk.sync(file_) != 0) return system_error("sync", path_);
  return {};
}

Status OpenFile::read_at(std::span<std::byte> data, uint64_t offset) const {
  KILN_CHECK(is_open());
  while (!data.empty()) {
    const ssize_t got = ::pread(file_, data.data(), data.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error("read", path_);
    if (got == 0)
      return fail(ErrorKind::kIo,
                  text("{}: ends at {}, before its expected contents", path_.string(), offset));
    data = data.subspan(static_cast<size_t>(got));
    offset += static_cast<uint64_t>(got);
  }
  return {};
}

std::vector<fs::path> list_folder(const fs::path& folder) {
  std::vector<fs::path> names;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code))
    names.push_back(it->path());
  std::sort(names.begin(), names.end());
  return names;
}

Status sync_folder(DiskCalls& disk, const fs::path& folder) {
  const OpenFile file(folder, O_RDONLY | O_DIRECTORY);
  if (!file.is_open()) return system_error("open", folder);
  return file.sync(disk);
}

Status make_folder(DiskCalls& disk, const fs::path& folder) {
  std::error_code code;
  if (fs::is_directory(folder, code)) return {};
  const fs::path above = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  if (!fs::exists(above, code)) KILN_TRY_STATUS(make_folder(disk, above));
  // Scenes and results are their owner's alone, from the first moment on.
  if (::mkdir(folder.c_str(), 0700) != 0)
    if (const int error = errno; error != EEXIST || !fs::is_directory(folder, code))
      return system_error("make the folder", folder, std::error_code(error, std::generic_category()));
  return sync_folder(disk, above);
}

}  // namespace kiln

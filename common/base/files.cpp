#include "common/base/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

class File {
 public:
  File(const fs::path& path, int flags, mode_t mode = 0644)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

tl::unexpected<Error> os_error(std::string_view doing, const fs::path& path) {
  const int code = errno;
  const ErrorKind kind = code == ENOSPC || code == EDQUOT ? ErrorKind::kNoSpace : ErrorKind::kIo;
  return fail(kind, text("cannot {} {}: {}", doing, path.string(), std::strerror(code)));
}

const char* kind_of(mode_t mode) {
  return S_ISDIR(mode)                    ? "a folder"
         : S_ISFIFO(mode)                 ? "a pipe"
         : S_ISSOCK(mode)                 ? "a socket"
         : S_ISCHR(mode) || S_ISBLK(mode) ? "a device"
                                          : "something else";
}

fs::path temporary_beside(const fs::path& path) {
  // Same extension, because image writers choose the format by it.
  return path.parent_path() /
         text(".{}.{}.partial{}", path.stem().string(), ::getpid(), path.extension().string());
}

Status sync_path(const fs::path& path, int flags) {
  File file(path, flags);
  if (file.fd() < 0) return os_error("open", path);
  if (::fsync(file.fd()) != 0) return os_error("sync", path);
  return {};
}

Status write_bytes(const fs::path& path, std::span<const std::byte> data, int flags, mode_t mode) {
  File file(path, O_WRONLY | O_CREAT | flags, mode);
  if (file.fd() < 0) return os_error("create", path);
  size_t done = 0;
  while (done < data.size()) {
    const ssize_t put = ::write(file.fd(), data.data() + done, data.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return os_error("write", path);
    done += static_cast<size_t>(put);
  }
  return {};
}

}  // namespace

Expected<Bytes> read_file(const fs::path& path, uint64_t max_bytes) {
  const File file(path, O_RDONLY | O_NONBLOCK);  // opening a pipe would wait for its writer
  struct stat about {};
  if (file.fd() < 0 && errno != ENOENT && errno != ENOTDIR && errno != ENXIO) return os_error("open", path);
  if (file.fd() >= 0 ? ::fstat(file.fd(), &about) != 0 : ::stat(path.c_str(), &about) != 0)
    return fail(ErrorKind::kInvalidInput, text("{}: no such file", path.string()));
  if (!S_ISREG(about.st_mode))
    return fail(ErrorKind::kInvalidInput,
                text("{}: it is {}, not a file", path.string(), kind_of(about.st_mode)));
  const auto size = static_cast<uint64_t>(about.st_size);
  if (size > max_bytes)
    return fail(ErrorKind::kInvalidInput,
                text("{}: {} bytes, more than the limit of {}", path.string(), size, max_bytes));
  Bytes data(size);
  uint64_t done = 0;
  while (done < size) {
    const ssize_t got = ::read(file.fd(), data.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return os_error("read", path);
    if (got == 0) return fail(ErrorKind::kIo, text("{}: became shorter while it was read", path.string()));
    done += static_cast<uint64_t>(got);
  }
  return data;
}

Status write_atomic(const fs::path& path, const std::function<Status(const fs::path&)>& write) {
  const fs::path temporary = temporary_beside(path);
  std::error_code ignored;
  if (Status s = write(temporary); !s) {
    fs::remove(temporary, ignored);
    return s;
  }
  if (Status s = sync_path(temporary, O_RDONLY); !s) {
    fs::remove(temporary, ignored);
    return s;
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    auto error = os_error("rename a finished file to", path);
    fs::remove(temporary, ignored);
    return error;
  }
  return sync_path(path.has_parent_path() ? path.parent_path() : fs::path("."), O_RDONLY | O_DIRECTORY);
}

Status write_file_atomic(const fs::path& path, std::span<const std::byte> data) {
  return write_atomic(path,
                      [&](const fs::path& temporary) { return write_bytes(temporary, data, O_TRUNC, 0644); });
}

Status write_file_atomic(const fs::path& path, std::string_view text) {
  return write_file_atomic(path, bytes_of(text));
}

Status write_private_file(const fs::path& path, std::string_view text) {
  return write_atomic(path, [&](const fs::path& temporary) {
    // A leftover file may have other permissions: never write into an existing one.
    std::error_code ignored;
    fs::remove(temporary, ignored);
    return write_bytes(temporary, bytes_of(text), O_EXCL, 0600);
  });
}

Status prepare_output_folder(const fs::path& folder, uint64_t need_bytes) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code || !fs::is_directory(folder))
    return fail(ErrorKind::kInvalidInput, text("cannot make the output folder {}: {}", folder.string(),
                                               code ? code.message() : "it is not a folder"));
  const fs::path probe = folder / text(".kiln-probe.{}", ::getpid());
  {
    File file(probe, O_WRONLY | O_CREAT | O_TRUNC);
    if (file.fd() < 0)
      return fail(ErrorKind::kInvalidInput,
                  text("cannot write into the output folder {}: {}", folder.string(), std::strerror(errno)));
  }
  fs::remove(probe, code);
  const fs::space_info space = fs::space(folder, code);
  if (!code && space.available < need_bytes)
    return fail(
        ErrorKind::kInvalidInput,
        text("the output folder {} has {} MiB free and the outputs need about {} MiB: free some space "
             "or choose another folder with -o",
             folder.string(), space.available >> 20, (need_bytes >> 20) + 1));
  return {};
}

}  // namespace kiln

#include "coordinator/farm/queue/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;

Expected<FolderLock> FolderLock::take(const fs::path& folder) {
  const fs::path path = folder / "lock";
  for (;;) {
    std::error_code code;
    const bool made = !fs::exists(path, code);
    OpenFile file(path, O_RDWR | O_CREAT);
    if (!file.is_open()) return system_error("open", path);
    if (::flock(file.number(), LOCK_EX | LOCK_NB) != 0) {
      if (errno == EINTR) continue;
      if (errno != EWOULDBLOCK) return system_error("lock", path);
      const auto holder = read_file(path, 4096);
      const std::string who = holder && !holder->empty()
                                  ? std::string(reinterpret_cast<const char*>(holder->data()), holder->size())
                                  : "another process";
      return fail(
          ErrorKind::kUnavailable,
          text("{} is in use by {}: stop that coordinator, or choose another folder", folder.string(), who));
    }
    // Its creator may have given up and removed it: a lock on an unlinked file excludes nobody.
    struct stat by_name, by_file;
    if (::stat(path.c_str(), &by_name) != 0 || ::fstat(file.number(), &by_file) != 0 ||
        by_name.st_ino != by_file.st_ino)
      continue;
    return FolderLock(std::move(file), made);
  }
}

Status FolderLock::sign() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string who = text("process {} on {}", ::getpid(), host.data());
  if (::ftruncate(file_.number(), 0) != 0) return system_error("write", file_.path());
  KILN_TRY_STATUS(file_.write_at(real_disk_calls(), bytes_of(who), 0));
  signed_ = true;
  return {};
}

FolderLock::~FolderLock() {
  if (!file_.is_open()) return;
  if (signed_) {
    (void)!::ftruncate(file_.number(), 0);
  } else if (made_) {
    ::unlink(file_.path().c_str());
  }
}

}  // namespace kiln

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "common/base/format.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/snapshot/snapshot.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

Status copy_blob(const fs::path& blob, const fs::path& target) {
  const OpenFile in(blob, O_RDONLY);
  if (!in.is_open()) return system_error("open", blob);
  const OpenFile out(target, O_WRONLY | O_CREAT | O_EXCL);
  if (!out.is_open()) return system_error("create", target);
  KILN_TRY_STATUS(copy_file(in, out, real_disk_calls(), UINT64_MAX));
  return {};
}

// Copies where links are impossible: another file system, one without links, or a blob at its link limit.
bool cannot_link(int code) {
  return code == EXDEV || code == EPERM || code == EMLINK || code == EOPNOTSUPP || code == ENOSYS;
}

}  // namespace

Status lay_out(const std::vector<FileRecord>& files, const BlobStore& blobs, const fs::path& folder) {
  KILN_TRY_STATUS(check_files("input", files));
  std::error_code code;
  if (fs::exists(folder, code) && !fs::is_empty(folder, code))
    return fail(ErrorKind::kIo,
                text("{} is not empty: a scene is laid out in a folder of its own", folder.string()));
  fs::create_directories(folder, code);
  if (code) return system_error("make the folder", folder, code);
  for (const FileRecord& file : files) {
    const fs::path target = folder / file.path, blob = blobs.path(file.digest);
    const auto size = blobs.size(file.digest);
    if (!size || *size != file.size)
      return fail(ErrorKind::kInvalidInput,
                  text("the bytes of {} ({}) are not in the store: submit the job again", file.path,
                       file.digest.hex()));
    fs::create_directories(target.parent_path(), code);
    if (code) return system_error("make the folder", target.parent_path(), code);
    if (::link(blob.c_str(), target.c_str()) == 0) continue;
    if (!cannot_link(errno)) return system_error("link", target);
    KILN_TRY_STATUS(copy_blob(blob, target));
  }
  return {};
}

}  // namespace kiln

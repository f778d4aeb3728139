#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "common/base/format.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/snapshot/snapshot.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

// Copies where links are impossible: another file system, one without links, or a blob at its link limit.
bool cannot_link(int code) {
  return code == EXDEV || code == EPERM || code == EMLINK || code == EOPNOTSUPP || code == ENOSYS;
}

// Makes the file and says what its bytes are: of the very file that the import will read.
Expected<HashedFile> place(const fs::path& blob, const fs::path& target) {
  const OpenFile in(blob, O_RDONLY);
  if (!in.is_open()) return system_error("open", blob);
  if (::link(blob.c_str(), target.c_str()) == 0) {
    const OpenFile linked(target, O_RDONLY);
    if (!linked.is_open()) return system_error("open", target);
    return hash_file(linked);
  }
  if (!cannot_link(errno)) return system_error("link", target);
  const OpenFile out(target, O_WRONLY | O_CREAT | O_EXCL);
  if (!out.is_open()) return system_error("create", target);
  return copy_file(in, out, real_disk_calls(), UINT64_MAX);
}

Status lay_out_file(const FileRecord& file, BlobStore& blobs, const fs::path& folder) {
  const fs::path target = folder / file.path;
  std::error_code code;
  fs::create_directories(target.parent_path(), code);
  if (code) return system_error("make the folder", target.parent_path(), code);
  if (!blobs.has(file.digest))
    return fail(
        ErrorKind::kInvalidInput,
        text("the bytes of {} (blob {}) are not in the store: submit the scene again, which sends them",
             file.path, file.digest.hex()));
  const auto placed = place(blobs.path(file.digest), target);
  if (placed && placed->digest == file.digest) return {};
  KILN_TRY(const BlobState state, blobs.verify(file.digest));
  if (!placed && state == BlobState::kIntact)
    return tl::unexpected<Error>(placed.error());  // not the blob's fault
  return fail(
      ErrorKind::kInvalidInput,
      text("the coordinator's copy of {} (blob {}) was damaged on its disk and lies in {} now: submit the "
           "scene again, which sends the file anew; `kiln retry` bakes this job after that",
           file.path, file.digest.hex(), blobs.damaged_path(file.digest).parent_path().string()));
}

}  // namespace

Status lay_out(const std::vector<FileRecord>& files, BlobStore& blobs, const fs::path& folder) {
  KILN_TRY_STATUS(check_files("input", files));
  std::error_code code;
  if (fs::exists(folder, code) && !fs::is_empty(folder, code))
    return fail(ErrorKind::kIo,
                text("{} is not empty: a scene is laid out in a folder of its own", folder.string()));
  fs::create_directories(folder, code);
  if (code) return system_error("make the folder", folder, code);
  for (const FileRecord& file : files) {
    const Status laid = lay_out_file(file, blobs, folder);
    if (laid) continue;
    fs::remove_all(folder, code);
    return laid;
  }
  return {};
}

}  // namespace kiln

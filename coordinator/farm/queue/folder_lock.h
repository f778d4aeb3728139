// One coordinator for a folder: flock on folder/lock, in which it says who it is.
#pragma once

#include <filesystem>
#include <string>

#include "coordinator/farm/queue/open_file.h"

namespace kiln {

class FolderLock {
 public:
  // Fails (kUnavailable) with what the holder wrote, if there is one. Nothing is written yet.
  static Expected<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&&) = default;
  ~FolderLock();

  // Writes "process N on HOST" for the next who asks; from now on the file stays when the lock is given up.
  Status sign();

 private:
  FolderLock(OpenFile file, bool made) : file_(std::move(file)), made_(made) {}
  OpenFile file_;
  bool made_ = false;  // by us, and not signed
  bool signed_ = false;
};

}  // namespace kiln

// Ensures one coordinator per folder: flock on folder/lock, which names the holder.
#pragma once

#include <filesystem>
#include <string>

#include "coordinator/farm/queue/open_file.h"

namespace kiln {

class FolderLock {
 public:
  // Fails (kUnavailable) with the holder's text, if there is one. Writes nothing yet.
  static Expected<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&&) = default;
  ~FolderLock();

  // Writes "process N on HOST" for others; from now on the file remains when the lock is released.
  Status sign();

 private:
  FolderLock(OpenFile file, bool made) : file_(std::move(file)), made_(made) {}
  OpenFile file_;
  bool made_ = false;  // by us, and not signed
  bool signed_ = false;
};

}  // namespace kiln

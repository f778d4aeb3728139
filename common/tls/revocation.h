// Revoked certificates: a text file with one serial per line, read again whenever it changes.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>

#include "common/base/status.h"

namespace kiln {

// Parses lines of one hex serial, in either case, with "#" comments. Fails (kInvalidInput) naming the line.
Expected<std::set<std::string>> parse_revoked(std::string_view text);

// From any thread.
class RevocationList {
 public:
  // A file that does not exist is an empty list.
  explicit RevocationList(std::filesystem::path file) : file_(std::move(file)) {}
  // `serial` as in PeerIdentity. Fails while the file cannot be read, or after it disappears: without the
  // list nobody is admitted.
  Expected<bool> contains(const std::string& serial) const;

 private:
  // Identifies one state of the file: a rename over it changes the inode.
  struct Stamp {
    uint64_t inode = 0, size = 0;
    int64_t seconds = 0, nanoseconds = 0;
    bool operator==(const Stamp&) const = default;
  };
  Status refresh() const;  // with the lock held

  std::filesystem::path file_;
  mutable std::mutex mutex_;
  mutable Stamp read_;  // inode 0: never
  mutable std::set<std::string> serials_;
};

}  // namespace kiln

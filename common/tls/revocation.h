// Revoked certificates: text files with one serial per line, read again whenever they change.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// Parses lines of one hex serial, in either case, with "#" comments. Fails (kInvalidInput) naming the line.
Expected<std::set<std::string>> parse_revoked(std::string_view text);

// The serials of all the lists together. From any thread.
class RevocationLists {
 public:
  // A file that does not exist is an empty list.
  explicit RevocationLists(const std::vector<std::filesystem::path>& files);
  // `serial` as in PeerIdentity. A serial that was listed once stays revoked: a list that becomes unreadable,
  // is cut short while it is copied, or disappears lets nobody back in. That is logged, once for each state
  // of the file. Fails while a list cannot be read that never could: nobody knows whom it names.
  Expected<bool> contains(const std::string& serial) const;

  struct Extent {
    size_t files = 0;    // that were read
    size_t serials = 0;  // in all of them, ever: this only grows
  };
  Extent extent() const;

 private:
  // Identifies one state of a file: a rename over it changes the inode, a write into it the times.
  struct Stamp {
    uint64_t inode = 0, size = 0;  // inode 0: no file
    int64_t written_s = 0, written_ns = 0, changed_s = 0, changed_ns = 0;
    bool operator==(const Stamp&) const = default;
  };
  struct File {
    std::filesystem::path path;
    Stamp seen;
    int code = 0;                   // of stat(2), which gave `seen`
    bool read = false;              // ever
    bool again = true;              // even if it has not changed
    std::string failure;            // to read what was seen
    std::set<std::string> serials;  // of the last good state
  };
  // With the lock held.
  void refresh(File& file) const;
  Status read(File& file) const;

  mutable std::mutex mutex_;
  mutable std::vector<File> files_;
  mutable std::set<std::string> serials_;
};

}  // namespace kiln

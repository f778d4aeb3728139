// How a bake's files replace those of an earlier one: all of them are written into a hidden folder inside the
// output folder first, so that a bake that fails or is cancelled leaves the earlier one whole.
//
// Order of publish(), against a crash at any point:
//   1. stale files go: those that the earlier report.json or encode.json lists and that are not written now
//   2. encode.json and then report.json go: until step 4 the folder says of itself that it is no finished
//   bake
//   3. the new files are renamed into the folder
//   4. the new report, last, by rename
// After a crash in step 1 the earlier report is still there and lists what is left. After one in step 2 or 3
// the hidden folder still has the new report, and the next open() removes what that lists.
#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace kiln {

// What publish() does about files of an earlier bake.
enum class Earlier : uint8_t { kRemove, kKeep };

class PublishFolder {
 public:
  // Makes the hidden folder in `output`, which exists, and empties one that a crash has left. Errors: kIo;
  // another process publishes into the same folder.
  static Expected<PublishFolder> open(const std::filesystem::path& output);
  PublishFolder(PublishFolder&&) noexcept;
  PublishFolder& operator=(PublishFolder&&) noexcept = delete;
  ~PublishFolder();  // what was not published is removed

  const std::filesystem::path& path() const { return hidden_; }  // where files are to be written
  Expected<std::set<std::string>> names() const;                 // of the files there so far
  // Replaces the earlier bake. `last`: the file that makes the folder whole, "report.json" or "encode.json".
  Status publish(const std::string& last, Earlier earlier = Earlier::kRemove);

 private:
  PublishFolder(std::filesystem::path output, int lock);

  std::filesystem::path output_, hidden_;
  int lock_;  // of the output folder; -1: moved from
};

// Names that a report.json or encode.json lists as files of its bake. Only names of files directly in the
// folder count: a path, "..", a hidden name or one with control characters is left out. Empty where the text
// is no JSON object.
std::set<std::string> listed_files(std::string_view report);

// Removes the regular files of an earlier bake from a folder: what its report.json and encode.json list and
// `spare` does not have; then these two, report.json last. Never others: no folder, no symbolic link and
// nothing behind one. A missing or broken report.json lists nothing, and is left. Returns how many went.
Expected<size_t> remove_earlier_bake(const std::filesystem::path& folder, const std::set<std::string>& spare);

}  // namespace kiln

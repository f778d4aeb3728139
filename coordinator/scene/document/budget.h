// How much memory the import of one file may take. A few bytes of a glTF can ask for gigabytes: an accessor
// without data, an image of one colour, a file named ten thousand times. What they ask for is counted before
// it is taken, and the import stops with a sentence once it is more than a file of that size needs.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "common/base/status.h"

namespace kiln {

class ImportBudget {
 public:
  // Enough for any scene that does not repeat itself much; KILN_IMPORT_MIB allows more.
  static constexpr uint64_t kAnyFile = uint64_t{1} << 30, kTimesTheFile = 16;

  // `file_bytes`: of the glTF. The environment's KILN_IMPORT_MIB is a least size of the budget.
  ImportBudget(std::filesystem::path file, uint64_t file_bytes);

  // Counts a file that the glTF names towards the size of the scene.
  void add_file(uint64_t file_bytes);

  // Counts `bytes` for `what` ("its instances"). The sum alone decides: threads that take the same `what`
  // fail with the same words in any order. Error: kInvalidInput.
  Status take(uint64_t bytes, std::string_view what);
  bool is_spent() const { return taken_ > bytes_; }

 private:
  const std::filesystem::path file_;
  uint64_t bytes_ = 0;
  std::atomic<uint64_t> taken_{0};
};

}  // namespace kiln

#include "coordinator/scene/document/budget.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 60;  // a sum of a few stays within 64 bits

uint64_t bytes_of_environment() {
  const char* const given = std::getenv("KILN_IMPORT_MIB");
  if (!given) return 0;
  const std::string_view word(given);
  uint64_t mib = 0;
  const auto read = std::from_chars(word.data(), word.data() + word.size(), mib);
  const bool whole = read.ec == std::errc() && read.ptr == word.data() + word.size();
  return whole ? std::min(mib, kMostBytes >> 20) << 20 : 0;
}

}  // namespace

ImportBudget::ImportBudget(std::filesystem::path file, uint64_t file_bytes)
    : file_(std::move(file)), bytes_(std::max(kAnyFile, bytes_of_environment())) {
  add_file(file_bytes);
}

void ImportBudget::add_file(uint64_t file_bytes) {
  bytes_ = std::min(kMostBytes, bytes_ + kTimesTheFile * std::min(file_bytes, kMostBytes / kTimesTheFile));
}

Status ImportBudget::take(uint64_t bytes, std::string_view what) {
  // Saturates: what was refused must not wrap around and become little.
  uint64_t before = taken_;
  while (!taken_.compare_exchange_weak(before, std::min(before, kMostBytes) + std::min(bytes, kMostBytes))) {
  }
  if (!is_spent()) return {};
  return fail(ErrorKind::kInvalidInput,
              text("{}: {} would take more memory than the {} MiB that the import of a file of its size may "
                   "take: let it repeat less, or allow more with KILN_IMPORT_MIB=N in the environment",
                   file_.string(), what, bytes_ >> 20));
}

}  // namespace kiln

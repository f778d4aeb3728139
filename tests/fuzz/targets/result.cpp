#include "common/job/unit.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_result(std::span<const std::byte> data) {
  const auto result = read_result(data);
  require_sentence(result);
  if (!result) return;
  require(result->moments.size() == uint64_t{result->site_count} * result->plane_count,
          "a result that was read has a number for every site and plane");
  require(read_result(write_result(*result)).has_value(), "a result that was read can be written and read");
}

}  // namespace kiln::fuzz

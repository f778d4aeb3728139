#include "common/job/unit.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_job(std::span<const std::byte> data) {
  const auto job = read_job(data);
  require_sentence(job);
  if (job) require(read_job(write_job(*job)).has_value(), "a job that was read can be written and read");
}

}  // namespace kiln::fuzz

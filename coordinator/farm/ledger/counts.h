// Counters of a pass and of a job.
#pragma once

#include <cstdint>

namespace kiln {

struct PassCounts {
  uint32_t number = 0;  // since the coordinator started, from 1
  uint64_t units = 0, done = 0, failed = 0;
  double weight = 0, weight_done = 0;
};

struct JobCounts {
  uint32_t workers = 0, threads = 0;      // assigned to the job now
  uint64_t verified = 0, unverified = 0;  // of the results that count
  uint64_t waived = 0;                    // verifications waived because there was only one worker
  uint64_t duplicates = 0, copies = 0, reassigned = 0, lost = 0;
  uint64_t disputes = 0;  // units with differing, undecided answers
};

}  // namespace kiln

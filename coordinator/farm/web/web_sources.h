// Data sources of the pages and metrics: read-only, called from the web server's threads.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/farm/dispatch/farm_status.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct StoreHealth {
  uint64_t wal_bytes = 0;
  std::string held_for;                            // why the store cannot write; empty: it can
  uint64_t verified_bytes = 0, damaged_blobs = 0;  // of stored files that were read back
};

struct WebSources {
  std::function<FarmStatus()> farm;
  std::function<std::vector<JobRecord>()> jobs;  // by id
  std::function<std::optional<JobRecord>(JobId)> job;
  std::function<std::vector<JobEvent>(JobId)> events;  // oldest first
  std::function<StoreHealth()> store;
  std::string release;
};

}  // namespace kiln

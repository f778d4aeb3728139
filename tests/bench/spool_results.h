// The service's store of results, without the service: for measurements.
#pragma once

#include <filesystem>
#include <memory>

#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/service/durable_results.h"

namespace kiln::bench {

struct DiskResults {
  std::unique_ptr<Store> store;
  std::shared_ptr<DurableResultStore> results;  // ends before its store
  std::vector<KnownAnswer> known(JobId job) const;
};
DiskResults open_disk_results(const std::filesystem::path& folder);  // with job 1

// Results of all units, committed and settled.
void fill_store(const std::filesystem::path& folder, JobId job, const std::vector<WorkUnit>& units,
                uint32_t planes);

}  // namespace kiln::bench

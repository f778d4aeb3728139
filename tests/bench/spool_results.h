// Results of a farm in the queue's store, and nothing else of the service: for measurements.
#pragma once

#include <filesystem>
#include <memory>

#include "coordinator/dispatch/result_store.h"
#include "coordinator/queue/store.h"

namespace kiln::bench {

class SpoolResults final : public ResultStore {
 public:
  static std::shared_ptr<SpoolResults> open(const std::filesystem::path& folder);
  std::vector<KnownAnswer> known(JobId job);
  Store& store() { return *store_; }

  void put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
           std::function<void()> stored) override;
  void settle(const Settle& settle) override;
  void revoke(const Revoke& revoke) override;
  void pin_class(JobId, const std::string&) override {}
  void trust(const Trust&) override {}
  void quarantine(const Quarantine&) override {}
  void note(JobId, const std::string&) override {}
  void end_job(JobId) override {}
  Expected<std::shared_ptr<const UnitResult>> read(JobId job, uint64_t unit, const Digest& digest) override;

 private:
  std::unique_ptr<Store> store_;
};

// Results of all units, committed and settled.
void fill_store(const std::filesystem::path& folder, JobId job, const std::vector<WorkUnit>& units,
                uint32_t planes);

}  // namespace kiln::bench

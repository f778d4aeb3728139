// Implements a conductor's handle of a job. Internal to coordinator/farm/dispatch.
#pragma once

#include <set>

#include "common/base/clock.h"
#include "coordinator/farm/dispatch/farm_port.h"

namespace kiln {

class FarmImpl;

class FarmJobImpl final : public FarmJob {
 public:
  FarmJobImpl(FarmImpl& farm, const JobSpec& spec, std::shared_ptr<JobPort> port);
  ~FarmJobImpl() override;
  Digest add_chunk(Bytes bytes) override;
  Expected<PassEnd> run_pass(std::vector<WorkUnit> units, int64_t deadline_ms,
                             const PassHandlers& handlers) override;
  FarmStatistics statistics() override;

 private:
  Status check_units(const std::vector<WorkUnit>& units) const;
  void keep_named_chunks(const std::vector<WorkUnit>& units);
  PassEnd forget_sums();  // the job is rewound
  Status merge(const PassUnits& units, const DeliveredUnit& delivered, const PassHandlers& handlers);

  FarmImpl& farm_;
  const JobSpec spec_;
  const std::shared_ptr<JobPort> port_;
  const uint32_t planes_;
  SteadyClock clock_;
  FarmStatistics sums_;     // of the merged results
  std::set<Digest> added_;  // chunks of the job besides its scene
};

}  // namespace kiln

// The coordinator's view of its workers: hand out units, take results, survive losses.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/job/unit.h"
#include "common/scene/prepared.h"

namespace kiln {

struct FarmSettings {
  std::string listen_host = "127.0.0.1";
  uint16_t listen_port = 0;    // 0: any free port
  std::string token;           // workers must show it
  uint32_t local_workers = 1;  // worker processes to spawn and keep alive
  uint32_t local_threads = 1;  // threads of each
  std::string worker_program;  // path of kiln-worker
  uint32_t lease_ms = 15000;   // silence after which a worker's units go to another
  uint32_t max_attempts = 3;   // distinct workers a unit may kill before the pass fails
  // Fault injection for tests: every committed unit is answered again by a second lease.
  bool duplicate_every_unit = false;
};

struct FarmProgress {
  uint64_t units_done = 0, units_total = 0;
  uint64_t rays = 0;
  uint32_t workers = 0;
};

struct FarmStatistics {
  uint64_t rays = 0, units = 0, duplicates = 0, reassigned = 0, workers_lost = 0, nonfinite = 0;
  double worker_seconds = 0;  // thread-seconds of baking
  std::string numeric_class;
  std::vector<std::string> events;  // for the report: who joined, died, was given whose units
};

// All calls from one thread, which lives as long as the farm: local workers are killed with it.
class Farm {
 public:
  // Listens, spawns the local workers and returns without waiting for them.
  // `chunks` holds the scene and atlas chunks that `job` names and outlives the farm.
  static Expected<std::unique_ptr<Farm>> start(const FarmSettings& settings, const JobSpec& job,
                                               const ChunkStore& chunks);
  virtual ~Farm() = default;  // tells the workers to stop and reaps them

  // Hands out all units and calls on_result once per unit, on the calling thread, in the order of
  // arrival. Returns when every unit has been committed, with the error of on_result, when no worker can
  // be had any more, when a unit failed for good, or at `deadline_ms` (clock of clock.h; 0: none) with the
  // units that are committed by then: the return value says whether the pass is complete. on_progress is
  // called about ten times a second. After an error every further pass fails with it.
  virtual Expected<bool> run_pass(std::vector<WorkUnit> units, int64_t deadline_ms,
                                  const std::function<Status(const WorkUnit&, const UnitResult&)>& on_result,
                                  const std::function<void(const FarmProgress&)>& on_progress) = 0;
  virtual const FarmStatistics& statistics() const = 0;
  virtual uint16_t port() const = 0;
};

}  // namespace kiln

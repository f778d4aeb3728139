// The real store on the simulated disk, in virtual time: what the farm submits is written in order, a group
// at a time; while the disk refuses, nothing is reported as stored and everything from there on is tried
// again.
#pragma once

#include <deque>

#include "coordinator/farm/dispatch/result_store.h"
#include "coordinator/farm/queue/store.h"
#include "tests/agent_sim/clockwork.h"
#include "tests/agent_sim/sim_disk.h"

namespace kiln::sim {

class SimStore final : public ResultStore {
 public:
  // `on_hold`: the disk refuses, or writes again.
  SimStore(Store& store, ProcessTiming& timing, std::function<void(bool)> on_hold)
      : store_(store), timing_(timing), on_hold_(std::move(on_hold)) {}

  void put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
           std::function<void()> stored) override;
  void settle(const Settle& settle) override;
  void revoke(const Revoke& revoke) override;
  void pin_class(JobId job, const std::string& numeric_class) override;
  void trust(const Trust&) override {}
  void quarantine(const Quarantine&) override {}
  void note(JobId, const std::string&) override {}
  void end_job(JobId) override {}
  Expected<std::shared_ptr<const UnitResult>> read(JobId job, uint64_t unit, const Digest& digest) override;

  // Hands what waits to a store that will not finish it: the power goes during the write.
  void begin_and_die();
  uint64_t refused() const { return refused_; }

 private:
  struct Operation {
    std::function<void(Store::Callback)> attempt;
    std::function<void()> stored;
  };
  void give(Operation operation);
  void write();

  Store& store_;
  ProcessTiming& timing_;
  const std::function<void(bool)> on_hold_;
  std::deque<Operation> queue_;
  bool writing_ = false, held_ = false;
  uint64_t refused_ = 0;
};

}  // namespace kiln::sim

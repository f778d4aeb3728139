// Writes workers' answers to the store. One thread writes what the farm submits, in order; while
// the disk refuses, nothing is reported as stored, and everything is kept and retried.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

#include "coordinator/farm/dispatch/result_store.h"
#include "coordinator/farm/queue/store.h"

namespace kiln {

class DurableResultStore final : public ResultStore {
 public:
  // `on_hold(reason)`: called on the writing thread when writing fails, or works again (empty reason).
  // `on_note`: called on the farm's thread.
  struct Hooks {
    std::function<void(const std::string& reason)> on_hold;
    std::function<void(JobId, const std::string&)> on_note;
  };
  DurableResultStore(Store& store, Hooks hooks);
  ~DurableResultStore() override { stop(); }

  void put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
           std::function<void()> stored) override;
  void settle(const Settle& settle) override;
  void revoke(const Revoke& revoke) override;
  void pin_class(JobId job, const std::string& numeric_class) override;
  void trust(const Trust& trust) override;
  void quarantine(const Quarantine& quarantine) override;
  void note(JobId job, const std::string& text) override { hooks_.on_note(job, text); }
  void end_job(JobId) override {}  // results are removed once the outputs are safe: Store::conclude
  Expected<std::shared_ptr<const UnitResult>> read(JobId job, uint64_t unit, const Digest& digest) override;

  // Another write failed: everything is held until the disk accepts a probe.
  void suspect();
  // The same where a write has failed for certain: on_hold(reason) now, and again when a probe succeeds.
  void hold(const std::string& reason);
  uint64_t stored(JobId job) const;  // answers since this process started
  // Waits until everything submitted is written. Do not call while the disk may refuse.
  bool drain(std::chrono::milliseconds patience);
  void stop();  // anything not written by then was never acknowledged

 private:
  struct Operation {
    std::function<void(Store::Callback)> attempt;
    std::function<void()> stored;  // for an answer; called once
    JobId job = 0;
  };
  void give(Operation operation);
  void run();
  // Empty: all are written or invalid in themselves; otherwise the first to retry, and why.
  std::string write(std::deque<Operation>& batch);

  Store& store_;
  const Hooks hooks_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::deque<Operation> queue_;
  std::map<JobId, uint64_t> stored_;
  bool stopping_ = false, busy_ = false;
  std::atomic<bool> held_{false};
  std::thread thread_;
};

}  // namespace kiln

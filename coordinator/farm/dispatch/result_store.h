// Makes answers durable. Called by the farm on its thread; conductors read from theirs.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>

#include "common/job/unit.h"
#include "coordinator/farm/ledger/actions.h"

namespace kiln {

class ResultStore {
 public:
  virtual ~ResultStore() = default;
  virtual bool durable() const { return true; }
  // Calls `stored`, from any thread, once the answer would survive a power cut, and never before.
  virtual void put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
                   std::function<void()> stored) = 0;
  virtual void settle(const Settle& settle) = 0;
  virtual void revoke(const Revoke& revoke) = 0;
  virtual void pin_class(JobId job, const std::string& numeric_class) = 0;
  virtual void trust(const Trust& trust) = 0;
  virtual void quarantine(const Quarantine& quarantine) = 0;
  virtual void note(JobId job, const std::string& text) = 0;
  virtual void end_job(JobId job) = 0;  // the farm no longer needs its results
  // From a conductor's thread. An error means that the bytes are damaged: the unit is baked again.
  virtual Expected<std::shared_ptr<const UnitResult>> read(JobId job, uint64_t unit,
                                                           const Digest& digest) = 0;
};

// For a bake on one machine, which starts over after a crash. Keeps results that may be requested again.
class MemoryResultStore final : public ResultStore {
 public:
  void put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
           std::function<void()> stored) override;
  void settle(const Settle& settle) override;
  void revoke(const Revoke& revoke) override;
  void pin_class(JobId, const std::string&) override {}
  void trust(const Trust&) override {}
  void quarantine(const Quarantine&) override {}
  void note(JobId, const std::string&) override {}
  void end_job(JobId job) override;
  Expected<std::shared_ptr<const UnitResult>> read(JobId job, uint64_t unit, const Digest& digest) override;
  bool durable() const override { return false; }
  // Results are dropped when they are settled, because nothing can revoke them: machines are trusted.
  explicit MemoryResultStore(bool revocable) : revocable_(revocable) {}

 private:
  using Key = std::tuple<JobId, uint64_t, Digest>;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<const UnitResult>> answers_;
  const bool revocable_;
};

}  // namespace kiln

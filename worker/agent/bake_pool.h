// Bake threads that take units of any ready job from one queue.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/wire/messages.h"
#include "worker/agent/shared_cache.h"
#include "worker/bake/baker.h"

namespace kiln {

struct BakeTask {
  Unit unit;
  std::shared_ptr<const Baker> baker;
  std::shared_ptr<const SharedCache> cache;  // the cache that the unit names; null: none
  std::string replay_file, replay;           // written if this unit crashes; empty: nothing
};

class BakePool {
 public:
  // Called on a bake thread.
  using OnDone = std::function<void(const Unit&, Expected<UnitResult>)>;

  BakePool(unsigned threads, OnDone on_done);
  ~BakePool();  // drops queued units, waits for running ones
  void add(BakeTask task);
  // Removes units that no thread has started and for which `wanted` is true.
  std::vector<Unit> take_unbegun(const std::function<bool(const Unit&)>& wanted);
  size_t queued() const;
  struct Begun {
    uint64_t job = 0, unit = 0;
    int64_t at_ms = 0;  // SteadyClock
  };
  std::optional<Begun> oldest() const;  // among the running units

 private:
  void run();
  OnDone on_done_;
  SteadyClock clock_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<BakeTask> queue_;
  std::list<Begun> begun_;  // oldest first
  bool stop_ = false;
  std::vector<std::jthread> team_;  // last: ends first
};

}  // namespace kiln

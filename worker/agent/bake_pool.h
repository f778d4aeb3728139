// Bake threads that pull units from a queue.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "common/wire/messages.h"
#include "worker/bake/baker.h"

namespace kiln {

class BakePool {
 public:
  // Called on a bake thread.
  using OnDone = std::function<void(const Unit&, Expected<UnitResult>)>;

  BakePool(std::shared_ptr<const Baker> baker, unsigned threads, OnDone on_done);
  ~BakePool();  // drops what is queued, waits for what runs
  void add(Unit unit);
  std::vector<Unit> take_unbegun();
  size_t queued() const;

 private:
  void run();
  std::shared_ptr<const Baker> baker_;
  OnDone on_done_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Unit> queue_;
  bool stop_ = false;
  std::vector<std::jthread> team_;  // last: ends first
};

}  // namespace kiln

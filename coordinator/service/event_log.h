// Recent events, numbered, for programs that watch.
#pragma once

#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "coordinator/farm/ledger/rules.h"

namespace kiln {

struct ServiceEvent {
  uint64_t number = 0;
  int64_t at_ms = 0;
  JobId job = 0;  // 0: a farm event
  std::string text;
};

class EventLog {
 public:
  // Numbers are higher than those of earlier openings of the store.
  explicit EventLog(uint64_t epoch) : next_(epoch << 32 | 1) {}

  void add(int64_t at_ms, JobId job, std::string text) {
    const std::lock_guard lock(mutex_);
    if (events_.size() == kMax) events_.pop_front();
    events_.push_back({next_++, at_ms, job, std::move(text)});
  }
  // At most `most` events after `cursor`, of one job or (0) all; `cursor` advances to where to continue.
  std::vector<ServiceEvent> since(uint64_t& cursor, JobId job, size_t most) const {
    const std::lock_guard lock(mutex_);
    std::vector<ServiceEvent> found;
    for (const ServiceEvent& event : events_) {
      if (event.number < cursor) continue;
      if (found.size() == most) {
        cursor = event.number;
        return found;
      }
      if (job == 0 || event.job == job) found.push_back(event);
    }
    cursor = next_;
    return found;
  }

 private:
  static constexpr size_t kMax = 4096;
  mutable std::mutex mutex_;
  std::deque<ServiceEvent> events_;
  uint64_t next_;
};

}  // namespace kiln

#include "coordinator/farm/dispatch/farm_port.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {
namespace {

constexpr uint64_t kMaxQueued = uint64_t{256} << 20;  // bytes of results waiting for their conductor

uint64_t bytes_of_event(const PassEvent& event) {
  const auto* delivered = std::get_if<DeliveredUnit>(&event);
  return delivered && delivered->result ? delivered->result->moments.size() * sizeof(double) : 0;
}

}  // namespace

PassUnits::PassUnits(std::vector<WorkUnit> list) : units(std::move(list)) {
  for (size_t i = 0; i < units.size(); ++i) KILN_CHECK(place_.emplace(units[i].id, i).second);
}

const WorkUnit* PassUnits::find(uint64_t id) const {
  const auto it = place_.find(id);
  return it == place_.end() ? nullptr : &units[it->second];
}

void JobPort::push(PassEvent event) {
  {
    const std::lock_guard lock(mutex_);
    // A conductor that falls behind reads results from the store, so that they do not pile up in memory.
    if (auto* delivered = std::get_if<DeliveredUnit>(&event);
        delivered && durable_ && result_bytes_ > kMaxQueued)
      delivered->result.reset();
    result_bytes_ += bytes_of_event(event);
    events_.push_back(std::move(event));
  }
  changed_.notify_one();
}

void JobPort::fail_with(const Error& error) {
  {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = error;
  }
  changed_.notify_one();
}

void JobPort::set_progress(const FarmProgress& progress) {
  const std::lock_guard lock(mutex_);
  progress_ = progress;
}

bool JobPort::clear() {
  const std::lock_guard lock(mutex_);
  const bool rewound = std::any_of(events_.begin(), events_.end(), [](const PassEvent& event) {
    const auto* ended = std::get_if<PassEnded>(&event);
    return ended && ended->end == PassEnd::kRewound;
  });
  events_.clear();
  result_bytes_ = 0;
  progress_.units_done = progress_.units_total = 0;
  progress_.weight_done = progress_.weight = 0;
  return rewound;
}

std::optional<PassEvent> JobPort::pop(int64_t ms) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::milliseconds(ms), [&] { return error_ || !events_.empty(); });
  if (error_ || events_.empty()) return std::nullopt;
  PassEvent event = std::move(events_.front());
  events_.pop_front();
  KILN_CHECK(result_bytes_ >= bytes_of_event(event));
  result_bytes_ -= bytes_of_event(event);
  return event;
}

std::optional<Error> JobPort::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

FarmProgress JobPort::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

}  // namespace kiln

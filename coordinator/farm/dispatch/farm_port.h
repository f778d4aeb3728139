// Events about the units of a pass, in order, from the farm's thread to a conductor's.
// Internal to coordinator/farm/dispatch.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <variant>

#include "coordinator/farm/dispatch/farm.h"

namespace kiln {

struct DeliveredUnit {
  uint64_t unit;
  Digest digest;
  std::shared_ptr<const UnitResult> result;  // null: read it from the store
};
struct SkippedUnit {
  uint64_t unit;
  std::string reason;
};
struct PassEnded {
  PassEnd end;
};
using PassEvent = std::variant<DeliveredUnit, SkippedUnit, PassEnded>;

class JobPort {
 public:
  // `durable`: results can be read from the store as long as the job is open.
  explicit JobPort(bool durable) : durable_(durable) {}

  // The farm's thread.
  void push(PassEvent event);
  void fail_with(const Error& error);  // sticky
  void set_progress(const FarmProgress& progress);
  // Drops events and progress of the last pass. Returns true if the job was rewound since and its conductor
  // does not know yet.
  bool clear();

  // The conductor's thread. Waits at most `ms` for an event; nullopt if none arrived, or on an error.
  std::optional<PassEvent> pop(int64_t ms);
  std::optional<Error> error() const;
  FarmProgress progress() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<PassEvent> events_;
  const bool durable_;
  uint64_t result_bytes_ = 0;  // in the queue
  std::optional<Error> error_;
  FarmProgress progress_;
};

// The units of a pass, shared: the farm's thread sends them, the conductor merges their results.
struct PassUnits {
  explicit PassUnits(std::vector<WorkUnit> list);
  const WorkUnit* find(uint64_t id) const;
  const std::vector<WorkUnit> units;

 private:
  std::unordered_map<uint64_t, size_t> place_;
};

}  // namespace kiln

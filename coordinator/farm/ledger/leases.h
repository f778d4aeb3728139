// What a unit and a worker know of the leases between them: kept in the tables' rows, where every decision
// reads it, and changed by Grants alone.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

namespace kiln {

class UnitLeases {
 public:
  bool empty() const { return all_.empty(); }
  size_t size() const { return all_.size(); }
  const std::vector<uint64_t>& all() const { return all_; }

 private:
  friend class Grants;
  std::vector<uint64_t> all_;
};

class WorkerLeases {
 public:
  bool empty() const { return all_.empty(); }
  size_t size() const { return all_.size(); }
  const std::set<uint64_t>& all() const { return all_; }  // oldest first
  double weight() const { return weight_; }               // work that it holds
  double rate() const { return rate_; }                   // weight per ms of the whole worker; 0: not known
  // Units that others got while it was silent, which may still occupy its threads.
  size_t ghosts() const { return ghosts_; }

 private:
  friend class Grants;
  std::set<uint64_t> all_;
  double weight_ = 0, rate_ = 0;
  int64_t busy_since_ = 0;
  size_t ghosts_ = 0;
};

}  // namespace kiln

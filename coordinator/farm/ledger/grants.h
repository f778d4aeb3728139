// Which worker holds which unit, and which unit a worker gets next.
//
// Invariant: a lease stands in four places, in this table, with its unit, its worker and its job, and nowhere
// else; a worker holds a unit once, units of its own job alone, and no more than its credits; and a job's
// backlogs are what its workers hold beyond their threads.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_map>

#include "coordinator/farm/ledger/worker_table.h"

namespace kiln {

class Grants {
 public:
  using Unit = UnitTable::Unit;
  using Job = UnitTable::Job;
  using Worker = WorkerTable::Worker;
  struct Lease {
    WorkerTable::Ref worker;
    UnitTable::Ref unit;
    double weight;
    int64_t since;
  };
  struct Steal {
    UnitTable::Ref unit;
    WorkerId from = 0;
  };

  Grants(const FarmRules& rules, UnitTable& units, const WorkerTable& workers, const TrustTable& trust)
      : rules_(rules), units_(units), workers_(workers), trust_(trust) {}

  // Leases
  uint64_t add(const UnitTable::Ref& unit, const WorkerTable::Ref& worker, int64_t now);
  void release(uint64_t lease);
  void release_of(const UnitTable::Ref& unit);               // all leases of the unit
  void recall_of(const UnitTable::Ref& unit, Actions& out);  // and tells their workers
  void release_all(JobId job);
  void recall_all(JobId job, Actions& out);
  const Lease& at(uint64_t lease) const;
  uint64_t find(WorkerId worker, const Unit& unit) const;  // 0: none
  size_t count(JobId job) const { return book(job).leases.size(); }
  // The worker's answer ended this lease: what that says about its speed and the job's.
  void answered(uint64_t lease, int64_t now);
  void answered_without_lease(const WorkerTable::Ref& worker);
  void haunt(const WorkerTable::Ref& worker);  // what it holds goes to others, but may occupy its threads

  // Jobs
  void add_job(JobId job) { books_.try_emplace(job); }
  void end_job(JobId job);  // without leases
  void begin_pass(JobId job);
  void find_spare(int64_t now);

  // Choices. A unit, or none.
  UnitTable::Ref choose_suspect(const Worker& worker, JobId job) const;
  UnitTable::Ref choose_second(const Worker& worker, JobId job) const;
  Steal choose_steal(WorkerId id, const Worker& worker) const;
  UnitTable::Ref choose_copy(WorkerId id, JobId job, int64_t now) const;  // worker 0: for any worker
  void note_copy(const UnitTable::Ref& unit);
  // Whether a fruitless search in the job may be repeated now; counts it.
  bool may_search(JobId job, int64_t now);
  void note_fruitless(JobId job) { ++books_.at(job).searches; }
  bool holds_suspect(const Worker& worker) const;
  bool would_end_late(const Worker& worker, double weight, int64_t now) const;
  double usual_ms(JobId job, double weight) const;  // from grant to result; 0: not known
  JobId pick_job(const Worker& worker) const;
  bool has_work(JobId id, const Job& job, const Worker& worker) const;
  double turn(const Job& job, double more_threads) const;

  // What breaks the invariant, in words; empty: nothing.
  std::string audit() const;

 private:
  struct Speed {          // over a job's ready workers with known rate
    int64_t when = -1;    // time computed; -1: not yet
    double rate = 0;      // of all, weight per ms
    double least_ms = 0;  // per weight, on a thread of the fastest
  };
  struct Book {                                      // of a job
    std::set<uint64_t> leases;                       // oldest first
    std::set<std::pair<size_t, WorkerId>> backlogs;  // (units not started, worker): candidates to steal from
    double copied_weight = 0, turnaround_ms = 0, turnaround_weight = 0;
    mutable Speed speed;
    int64_t searched_at = 0;  // for units to steal or copy
    uint32_t searches = 0;    // fruitless searches since then
    bool spare = false;       // at the last tick: a worker held units it had not started, or was late
  };

  const Book& book(JobId job) const;
  void note_backlog(Book& book, const WorkerTable::Ref& worker, size_t held_before);
  void reckon_speed(JobId id, const Book& book, int64_t now) const;

  const FarmRules& rules_;
  UnitTable& units_;  // to find units by number; changes none
  const WorkerTable& workers_;
  const TrustTable& trust_;
  std::map<JobId, Book> books_;
  std::unordered_map<uint64_t, Lease> leases_;
  uint64_t next_lease_ = 1;
};

}  // namespace kiln

// The farm's workers: who is present, which job each serves, and whom its threads are counted for.
//
// Invariant: a worker that is ready or leaves has a job; a user's threads are those of the workers counted
// for that user; and what is known of a job's lack of workers is known of a job that exists.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "coordinator/farm/ledger/leases.h"
#include "coordinator/farm/ledger/trust_table.h"
#include "coordinator/farm/ledger/unit_table.h"

namespace kiln {

class WorkerTable {
 public:
  enum class Presence : uint8_t { kActive, kSilent, kDraining };
  struct Worker {
    WorkerTraits traits;
    IdentityId identity = 0;
    Presence presence = Presence::kActive;
    int64_t last_heard = 0;
    JobId job = 0;  // 0: none
    bool ready = false, leaving = false;
    uint32_t credits = 0;
    int64_t assigned_at = 0, charged_until = 0, benched_until = 0;
    std::set<std::pair<JobId, uint64_t>> failed_units;  // in a row
    uint32_t benched = 0;
    std::map<JobId, std::string> banned;
    std::map<JobId, std::string> classes;  // proven for the job's kernels
    std::optional<UserId> counted_for;     // the user charged for its threads
    WorkerLeases leases;
  };
  // How long a job has lacked workers.
  struct Lack {
    int64_t alone_since = -1;  // since when no second voter could answer
    bool alone = false;
    int64_t stuck_since = -1;                     // since when no worker of its class could take the rest
    std::map<WorkerId, std::string> other_class;  // unused workers and their class
  };
  // A worker: it can be read through this, and changed by the table. Valid until it leaves.
  class Ref {
   public:
    explicit operator bool() const { return worker_ != nullptr; }
    const Worker* operator->() const { return worker_; }
    const Worker& operator*() const { return *worker_; }
    WorkerId id() const { return id_; }
    WorkerLeases& leases() const { return worker_->leases; }

   private:
    friend class WorkerTable;
    Ref(WorkerId id, Worker* worker) : id_(id), worker_(worker) {}
    WorkerId id_;
    Worker* worker_;
  };

  explicit WorkerTable(const UnitTable& units) : units_(units) {}

  // Workers
  Ref add(WorkerId id, const WorkerTraits& traits, IdentityId identity, int64_t now);
  void remove(const Ref& worker);  // it holds nothing
  Ref find(WorkerId id);
  const Worker* find(WorkerId id) const;
  const std::map<WorkerId, Worker>& all() const { return workers_; }
  template <class F>
  void for_each(const F& f) {
    for (auto& [id, worker] : workers_) f(Ref(id, &worker));
  }
  uint32_t present() const;  // workers eligible for units
  void hear(const Ref& worker, int64_t now) { worker.worker_->last_heard = now; }
  void set_presence(const Ref& worker, Presence presence) { worker.worker_->presence = presence; }
  void bench(const Ref& worker, int64_t until);
  void ban(const Ref& worker, JobId job, const std::string& reason) { worker.worker_->banned[job] = reason; }
  void lift_ban(WorkerId worker, JobId job);
  void prove(const Ref& worker, JobId job, const std::string& numeric_class);
  void note_failed(const Ref& worker, JobId job, uint64_t unit) {
    worker.worker_->failed_units.insert({job, unit});
  }
  void clear_failed(const Ref& worker) { worker.worker_->failed_units.clear(); }

  // Their jobs
  void assign(const Ref& worker, JobId job, int64_t now);
  void make_ready(const Ref& worker, uint32_t credits, int64_t now);
  void unassign(const Ref& worker, int64_t now);
  void set_leaving(const Ref& worker, bool leaving) { worker.worker_->leaving = leaving; }
  void count_for(const Ref& worker, std::optional<UserId> user);
  void forget_job(JobId job);
  static bool may_work(JobId id, const UnitTable::Job& job, const Worker& worker);

  // Time of threads, charged to users while their units are held
  FairShare& share() { return share_; }
  const FairShare& share() const { return share_; }
  void charge(const Ref& worker, int64_t now);
  void start_charging(const Ref& worker, int64_t now) { worker.worker_->charged_until = now; }

  // Jobs that lack workers
  const Lack& lack(JobId job) const;
  void set_alone(JobId job, int64_t since, bool alone);
  void set_stuck(JobId job, int64_t since);
  void note_other_class(JobId job, WorkerId worker, const std::string& numeric_class);
  void clear_other_class(JobId job);

  // What breaks the invariant, in words; empty: nothing.
  std::string audit() const;

 private:
  const UnitTable& units_;
  std::map<WorkerId, Worker> workers_;
  std::map<JobId, Lack> lacks_;  // of jobs that lacked some once
  FairShare share_;
};

}  // namespace kiln

// The writer thread: processes queued operations as one group, first the spool, then one transaction, then
// the callbacks.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "coordinator/farm/queue/late_checks.h"
#include "coordinator/farm/queue/record_cache.h"
#include "coordinator/farm/queue/spool.h"
#include "coordinator/farm/queue/sqlite.h"
#include "coordinator/farm/queue/store.h"
#include "coordinator/farm/queue/tables.h"

namespace kiln {

// An operation's view inside its group's transaction.
class GroupTransaction {
 public:
  GroupTransaction(Database& database, const RecordCache& cache)
      : database_(database), tables_(database), cache_(cache) {}
  Database& database() { return database_; }
  Tables& tables() { return tables_; }
  std::optional<JobRecord> job(JobId id) const;  // as changed by the operations before
  bool has_job(JobId id) const;
  std::vector<JobRecord> jobs() const;
  std::optional<WorkerRecord> worker(const std::string& identity) const;
  void set_job(JobRecord job) { changes_.jobs[job.id] = std::move(job); }
  void remove_job(JobId id) { changes_.jobs[id] = std::nullopt; }
  void set_worker(WorkerRecord worker) { changes_.workers[worker.identity] = std::move(worker); }
  RecordChanges take_changes() { return std::move(changes_); }

 private:
  Database& database_;
  Tables tables_;
  const RecordCache& cache_;
  RecordChanges changes_;
};

struct Operation {
  // Inside the transaction. On kInvalidInput and kUsage only this operation fails, having changed nothing;
  // other errors fail the group, and it may be called again.
  std::function<Status(GroupTransaction&)> apply;
  Store::Callback done;
  // Called once committed, on the writer thread; makes the operation the last of its group.
  std::function<Status()> after;
  bool reads = false;    // read-only: works on a full disk
  bool removes = false;  // deletes results
  struct Payload {
    UnitCommit commit;
    std::shared_ptr<const Bytes> bytes;
    std::optional<SpoolPlace> place;  // set before apply(), unless the result is already stored
  };
  std::shared_ptr<Payload> payload;
  Status status;  // of the attempt
};

class GroupWriter {
 public:
  // What must be written before anything else; tried before each group that writes, until it succeeds.
  using FirstWrite = std::function<Status(Database&)>;
  GroupWriter(Database database, Spool spool, RecordCache& cache, const StoreOptions& options,
              FirstWrite first, LateChecks late);
  ~GroupWriter() { stop(); }

  void give(Operation operation);
  Status give_and_wait(Operation operation);  // not from a callback
  // Writes queued operations and ends the thread; later operations fail.
  void stop();

  // Writer thread only: from `after`.
  Spool& spool() { return spool_; }
  Database& database() { return database_; }
  Status finish_late();  // all that LateChecks has left; its damage, if any

 private:
  void run();
  void late_step();
  std::vector<Operation> take_group(std::unique_lock<std::mutex>& lock);
  void write_group(std::vector<Operation>& group);
  bool begin_writing(std::span<Operation> group);  // false: the group's writes have failed
  void write_payloads(std::span<Operation> group);
  Status make_room_in_log(std::span<const Operation> group);
  // One transaction. Changes nothing on failure.
  Status attempt(std::span<Operation* const> operations);
  void compact_if_over(uint64_t bytes);

  Database database_;
  Spool spool_;
  RecordCache& cache_;
  const StoreOptions options_;
  FirstWrite first_;  // empty: done
  LateChecks late_;
  const std::chrono::steady_clock::time_point opened_ = std::chrono::steady_clock::now();
  Status damage_;        // of the database, found late: nothing is written any more
  bool warned_ = false;  // about a log that cannot be emptied

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Operation> queue_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace kiln

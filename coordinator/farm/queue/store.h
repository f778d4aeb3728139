// The farm's durable state, which survives `kill -9`, a power cut and a restart (docs/storage.md): job
// records, results of units, workers' reputations.
//
// One thread writes. Queued operations form one group: results are appended to the spool and synced, then one
// SQLite transaction commits with full sync, then the callbacks run, in queue order. Operations reported as
// done are on disk; failed ones are reported with the reason and may be repeated, so a full disk costs only
// time.
//
// Thread-safe. Functions with a callback return immediately, and the callback runs on the writer thread,
// where blocking functions must not be called. Functions without a callback wait for the disk.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "coordinator/farm/queue/disk_calls.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct StoreOptions {
  uint64_t spool_file_bytes = uint64_t{256} << 20;  // a spool file is full at this size
  uint32_t group_operations = 1024;                 // of one transaction, at most
  uint64_t group_bytes = uint64_t{64}
                         << 20;  // payload of one group; a single larger result is still accepted
  uint64_t wal_bytes =
      uint64_t{8} << 20;          // the log is emptied at this size; it never exceeds this plus one group
  uint32_t events_per_job = 256;  // the oldest are dropped
  std::string release = "0.1.0";  // of the program; stored, for people
  DiskCalls* faults = nullptr;    // tests: fails calls on spool files; nullptr: the real ones
};

class Store {
 public:
  using Callback = std::function<void(Status)>;
  // Modifies a record in place, or refuses. Called on the writer thread, and again if the disk failed.
  using Edit = std::function<Status(JobRecord&)>;

  // Creates the folder if needed, takes its lock, migrates an older schema, increments the epoch, checks and
  // loads all but results and events, which are checked later. Fails and leaves the folder unchanged if
  // another coordinator holds it (naming the process and host), if a newer release wrote it, or if the
  // database is damaged.
  static Expected<std::unique_ptr<Store>> open(const std::filesystem::path& folder,
                                               const StoreOptions& options);
  virtual ~Store() = default;  // as close()

  // Writes queued operations, empties the log and releases the lock. Later operations fail (kUnavailable).
  virtual void close() = 0;

  virtual uint64_t epoch() const = 0;  // incremented by every opening
  virtual const std::filesystem::path& folder() const = 0;

  // --- jobs
  // Durable on return; `job.id` is ignored. Fails if check_job() does.
  // If the user already has a job with the same nonempty submission key, returns its id instead.
  virtual Expected<JobId> submit(const JobRecord& job) = 0;
  virtual Status change(JobId job, const Edit& edit) = 0;  // durable on return; atomic
  virtual Status update(const JobRecord& job) = 0;         // durable on return; the whole record is replaced
  virtual void update(const JobRecord& job, Callback done) = 0;
  virtual std::vector<JobRecord> jobs() const = 0;  // durable ones, by id; from memory
  virtual std::optional<JobRecord> job(JobId id) const = 0;
  virtual void event(JobId job, int64_t at_ms,
                     std::string text) = 0;                       // does not wait; lost only with the disk
  virtual Expected<std::vector<JobEvent>> events(JobId job) = 0;  // oldest first
  // Restricts results to this numeric class from now on.
  virtual void pin_class(JobId job, const std::string& numeric_class, Callback done) = 0;
  // Removes ended jobs with all their data. Fails (kUsage) on one that has not ended.
  virtual Status forget(JobId job) = 0;
  // The same for every job that ended before `before_ms` and is not named in `after` of a remaining job.
  virtual Expected<std::vector<JobId>> forget_ended(int64_t before_ms) = 0;

  // --- results of units
  // Stores a result. Also succeeds if the same (job, unit, digest) exists; `verified` is then set if given,
  // never cleared. The payload is not copied.
  virtual void commit_result(const UnitCommit& commit, std::shared_ptr<const Bytes> payload,
                             Callback done) = 0;
  // Makes this answer the unit's result and removes the others. Fails (kInvalidInput) if it does not exist.
  // `worker`, if given, vouches for it from now on.
  virtual void settle(JobId job, uint64_t unit, const Digest& winner, bool verified,
                      const std::string& worker, Callback done) = 0;
  // Revokes one answer; also succeeds if it does not exist.
  virtual void revoke_answer(JobId job, uint64_t unit, const Digest& digest, Callback done) = 0;
  // Changes the record of a finished job, as change(), and removes its results and passes. Keeps the number
  // of results that only one worker gave: they taint the job if that worker is quarantined, now or later.
  virtual Status conclude(JobId job, const Edit& edit) = 0;
  // Revokes all results of the units, which then run again.
  virtual void revoke(JobId job, std::vector<uint64_t> units, Callback done) = 0;
  // All results of a job, by unit, then digest.
  virtual Expected<std::vector<CommitRow>> commits(JobId job) = 0;
  // The payload, with verified checksum. Reads only the file, without waiting for the writer. A damaged
  // record is kIo with file and offset: revoke the unit to compute it again.
  virtual Expected<Bytes> read_result(const CommitRow& row) const = 0;
  // The same with a lookup first, which waits. kInvalidInput if there is none.
  virtual Expected<Bytes> read_result(JobId job, uint64_t unit, const Digest& digest) = 0;
  // Removes all results and passes of a job.
  virtual void drop_results(JobId job, Callback done) = 0;

  // --- passes
  // Fails (kInvalidInput) if the pass is stored with another cut.
  virtual void put_pass(JobId job, const PassRecord& pass, Callback done) = 0;
  virtual Expected<std::vector<PassRecord>> passes(JobId job) = 0;  // by pass

  // --- workers, by identity
  virtual void put_worker(const WorkerRecord& worker, Callback done) = 0;
  virtual std::optional<WorkerRecord> worker(const std::string& identity) const = 0;
  virtual std::vector<WorkerRecord> workers() const = 0;
  // Sets how often its answers agreed with another's in a row; creates the record if needed.
  virtual void note_trust(const std::string& identity, uint64_t agreed, int64_t at_ms, Callback done) = 0;
  // Also taints finished jobs with results that only this worker gave.
  virtual void quarantine(const std::string& identity, const std::string& reason, int64_t at_ms,
                          Callback done) = 0;
  // Ends a quarantine and resets trust. Fails (kInvalidInput) on an unknown identity.
  virtual Status forgive(const std::string& identity) = 0;

  // Copies the database to a file and makes links to all spool files in a folder on the same file system, as
  // they are at one moment between writes; the jobs of that moment. For backup.h.
  virtual Expected<std::vector<JobRecord>> copy_now(const std::filesystem::path& database,
                                                    const std::filesystem::path& links) = 0;

  // --- health
  // Writes and syncs a little through the spool and the database; success means that writing works (again).
  virtual Status probe() = 0;
  // Waits until all earlier operations are written or have reported failure.
  virtual Status flush() = 0;
  // Empties the log into the database, and checks and tidies what opening left for later (late_checks.h).
  // Both happen automatically: the log at wal_bytes, both after a second without writes.
  virtual Status compact() = 0;
  virtual uint64_t wal_size() const = 0;  // bytes
  // Verifies everything: SQLite's own check and every record of every result. One message per fault; empty:
  // intact.
  virtual Expected<std::vector<std::string>> check() = 0;
};

}  // namespace kiln

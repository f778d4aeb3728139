// Everything of the farm that must survive `kill -9`, a power cut and a restart (docs/storage.md): job
// records, results of units, workers' reputations.
//
// One thread writes. Every operation is queued, and all that is queued becomes one group: results are
// appended to the spool and synced, then one SQLite transaction commits with full sync, then the callbacks
// run, in the order of the queue. What was reported as done is on the disk; what failed was reported with the
// reason and may be given again: a disk that was full costs nothing but time.
//
// Every function may be called from any thread. Those with a callback return at once; it runs on the writer
// thread, where the functions that wait must not be called. Those without wait for the disk.
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
  uint64_t group_bytes = uint64_t{64} << 20;        // payload of one group; a single larger one still goes
  uint64_t wal_bytes =
      uint64_t{8} << 20;          // the log is emptied at this size; it never exceeds this and one group
  uint32_t events_per_job = 256;  // the oldest go
  std::string release = "0.1.0";  // of the program; stored, for people
  DiskCalls* faults = nullptr;    // tests: fails calls on spool files; nullptr: the real ones
};

class Store {
 public:
  using Callback = std::function<void(Status)>;
  // Changes a record in its place, or refuses to. Called on the writer thread, and again if the disk failed.
  using Edit = std::function<Status(JobRecord&)>;

  // Makes the folder if needed, takes its lock, migrates an older schema, raises the epoch, checks and loads.
  // Fails, and leaves the folder as it was, if another coordinator has it (naming the process and host), if a
  // newer release wrote it, or if the database is damaged.
  static Expected<std::unique_ptr<Store>> open(const std::filesystem::path& folder,
                                               const StoreOptions& options);
  virtual ~Store() = default;  // as close()

  // Writes what is queued, empties the log and gives up the lock. Operations given later fail (kUnavailable).
  virtual void close() = 0;

  virtual uint64_t epoch() const = 0;  // rises with every opening
  virtual const std::filesystem::path& folder() const = 0;

  // --- jobs
  // Durable on return; `job.id` is ignored. Fails if check_job() does.
  // A job of the same user and submission (unless that is empty) is not made again: its id is given.
  virtual Expected<JobId> submit(const JobRecord& job) = 0;
  virtual Status change(JobId job, const Edit& edit) = 0;  // durable on return; nobody comes between
  virtual Status update(const JobRecord& job) = 0;         // durable on return; the whole record is replaced
  virtual void update(const JobRecord& job, Callback done) = 0;
  virtual std::vector<JobRecord> jobs() const = 0;  // durable ones, by id; from memory
  virtual std::optional<JobRecord> job(JobId id) const = 0;
  virtual void event(JobId job, int64_t at_ms,
                     std::string text) = 0;                       // not waited for; lost only with the disk
  virtual Expected<std::vector<JobEvent>> events(JobId job) = 0;  // oldest first
  // Results of this numeric class only, from now on.
  virtual void pin_class(JobId job, const std::string& numeric_class, Callback done) = 0;
  // Removes ended jobs with all that is kept of them. Fails (kUsage) on one that has not ended.
  virtual Status forget(JobId job) = 0;
  // The same for every job that ended before `before_ms` and that no job that is kept names in `after`.
  virtual Expected<std::vector<JobId>> forget_ended(int64_t before_ms) = 0;

  // --- results of units
  // Stores a result. Success also if the same (job, unit, digest) is there already; `verified` then is
  // raised, never taken back. The payload is not copied.
  virtual void commit_result(const UnitCommit& commit, std::shared_ptr<const Bytes> payload,
                             Callback done) = 0;
  // Of the answers to a unit this one counts: the others go. Fails (kInvalidInput) if it is not there.
  // `worker`, if given, stands for it from now on.
  virtual void settle(JobId job, uint64_t unit, const Digest& winner, bool verified,
                      const std::string& worker, Callback done) = 0;
  // Takes back one answer; success also if it is not there.
  virtual void revoke_answer(JobId job, uint64_t unit, const Digest& digest, Callback done) = 0;
  // Changes the record of a job that is done, as change(), and its results and passes go. Of those that one
  // worker alone gave it is remembered how many: they taint the job if that worker is quarantined, now or
  // later.
  virtual Status conclude(JobId job, const Edit& edit) = 0;
  // Takes back all results of the units: they will run again.
  virtual void revoke(JobId job, std::vector<uint64_t> units, Callback done) = 0;
  // All results of a job, by unit, then digest.
  virtual Expected<std::vector<CommitRow>> commits(JobId job) = 0;
  // The payload, its checksum verified. Reads only the file: does not wait for the writer. A damaged record
  // is kIo, naming file and offset: revoke the unit, and it is computed again.
  virtual Expected<Bytes> read_result(const CommitRow& row) const = 0;
  // The same, looked up first (waits). kInvalidInput if there is none.
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
  // How often its answers agreed with another's, in a row; the record is made if there is none.
  virtual void note_trust(const std::string& identity, uint64_t agreed, int64_t at_ms, Callback done) = 0;
  // And jobs that are done are tainted, if they have results that it alone gave.
  virtual void quarantine(const std::string& identity, const std::string& reason, int64_t at_ms,
                          Callback done) = 0;
  // Ends a quarantine and begins the trust anew. Fails (kInvalidInput) on an unknown identity.
  virtual Status forgive(const std::string& identity) = 0;

  // --- health
  // Writes and syncs a little on the disk, through the spool's way and the database: success says that
  // writing works (again).
  virtual Status probe() = 0;
  // Waits until all that was given before is written, or its callback has said why not.
  virtual Status flush() = 0;
  // Empties the log into the database; done unasked at wal_bytes and when nothing has been written for a
  // second.
  virtual Status compact() = 0;
  virtual uint64_t wal_size() const = 0;  // bytes
  // Reads everything: SQLite's own check, every record of every result. One sentence per fault; empty: sound.
  virtual Expected<std::vector<std::string>> check() = 0;
};

}  // namespace kiln

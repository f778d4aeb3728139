// The store's SQL: reads and writes records. Each function runs a few statements inside its caller's
// transaction and checks before writing, so that a failure with kInvalidInput or kUsage changes nothing.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/farm/queue/records.h"
#include "coordinator/farm/queue/sqlite.h"

namespace kiln {

class Tables {
 public:
  explicit Tables(Database& database) : database_(database) {}

  Expected<uint64_t> load_epoch();
  Status set_epoch(uint64_t epoch, const std::string& release);

  Expected<JobId> add_job(const JobRecord& job);
  // `described`: scene, settings and lists may also differ from the stored ones.
  Status set_job(const JobRecord& job, bool described);
  Status remove_job(JobId job);  // with events; drop results first
  Expected<JobId> find_submission(const std::string& user, const std::string& submission);  // 0: none
  Expected<std::map<JobId, JobRecord>> load_jobs();

  Status add_event(JobId job, int64_t at_ms, std::string_view text, uint32_t kept);
  Expected<std::vector<JobEvent>> load_events(JobId job);

  Expected<bool> has_result(const UnitCommit& commit);  // the same job, unit, shape and digest
  Status add_result(const CommitRow& row);
  Status verify_result(const UnitCommit& commit);
  // `worker`: the identity that vouches for it; empty: the stored one.
  Status settle(JobId job, uint64_t unit, const Digest& winner, bool verified, const std::string& worker);
  Status revoke(JobId job, uint64_t unit);
  Status revoke_answer(JobId job, uint64_t unit, const Digest& digest);
  // Stores, by worker, how many settled results of the job only that worker gave.
  Status note_unproven(JobId job);
  struct Unproven {
    JobId job = 0;
    std::string worker;
    uint64_t units = 0;
  };
  Expected<std::vector<Unproven>> load_unproven(JobId job);
  Expected<std::vector<Unproven>> load_unproven(const std::string& worker);
  Status drop_results(JobId job);
  Expected<std::vector<CommitRow>> load_results(JobId job);
  // At most `most`, from this one on. Fails (kInvalidInput) if it does not exist.
  Expected<std::vector<CommitRow>> load_results_from(JobId job, uint64_t unit, const Digest& digest,
                                                     size_t most);
  // The used length of each of a job's spool files of openings before `epoch`: the end of its last record,
  // whose head of `record_head` bytes precedes the payload.
  Expected<std::map<SpoolFileId, uint64_t>> load_spool_ends(JobId job, uint64_t epoch, uint64_t record_head);

  Status put_pass(JobId job, const PassRecord& pass);
  Expected<std::vector<PassRecord>> load_passes(JobId job);

  Status put_worker(const WorkerRecord& worker);
  Expected<std::map<std::string, WorkerRecord>> load_workers();

 private:
  Database& database_;
};

}  // namespace kiln

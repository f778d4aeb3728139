// The statements of the store: records in, records out. Each function is a few statements inside the
// transaction of its caller; each checks before it writes, so that one which fails with kInvalidInput or
// kUsage has changed nothing.
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

  Expected<uint64_t> raise_epoch(const std::string& release);

  Expected<JobId> add_job(const JobRecord& job);
  // `described`: scene, settings and lists may differ from what is stored too.
  Status set_job(const JobRecord& job, bool described);
  Status remove_job(JobId job);  // with events; results are dropped before
  Expected<JobId> find_submission(const std::string& user, const std::string& submission);  // 0: none
  Expected<std::map<JobId, JobRecord>> load_jobs();

  Status add_event(JobId job, int64_t at_ms, std::string_view text, uint32_t kept);
  Expected<std::vector<JobEvent>> load_events(JobId job);

  Expected<bool> has_result(const UnitCommit& commit);  // the same job, unit, shape and digest
  Status add_result(const CommitRow& row);
  Status verify_result(const UnitCommit& commit);
  // `worker`: who stands for it; empty: who is written already.
  Status settle(JobId job, uint64_t unit, const Digest& winner, bool verified, const std::string& worker);
  Status revoke(JobId job, uint64_t unit);
  Status revoke_answer(JobId job, uint64_t unit, const Digest& digest);
  // Writes down how many settled results of the job nobody but their worker gave, by worker.
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
  Expected<CommitRow> load_result(JobId job, uint64_t unit, const Digest& digest);
  // How far each spool file is in use: the end of its last record, from `record_head` bytes before each
  // payload.
  Expected<std::map<SpoolFileId, uint64_t>> load_spool_ends(uint64_t record_head);

  Status put_pass(JobId job, const PassRecord& pass);
  Expected<std::vector<PassRecord>> load_passes(JobId job);

  Status put_worker(const WorkerRecord& worker);
  Expected<std::map<std::string, WorkerRecord>> load_workers();

 private:
  Database& database_;
};

}  // namespace kiln

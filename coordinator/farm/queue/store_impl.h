// Implementation of the store: each function is one operation of the writer.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "coordinator/farm/queue/folder_lock.h"
#include "coordinator/farm/queue/group_writer.h"
#include "coordinator/farm/queue/row_windows.h"
#include "coordinator/farm/queue/store.h"

namespace kiln {

class StoreImpl final : public Store {
 public:
  struct Loaded {
    std::map<JobId, JobRecord> jobs;
    std::map<std::string, WorkerRecord> workers;
    uint64_t epoch = 0;
    GroupWriter::FirstWrite begins;  // still to be done: the disk was full
  };
  StoreImpl(std::filesystem::path folder, const StoreOptions& options, FolderLock lock, Database database,
            Loaded loaded);
  ~StoreImpl() override { close(); }

  void close() override;
  uint64_t epoch() const override { return epoch_; }
  const std::filesystem::path& folder() const override { return folder_; }

  Expected<JobId> submit(const JobRecord& job) override;
  Status change(JobId job, const Edit& edit) override { return writer_.give_and_wait(change_of(job, edit)); }
  Status update(const JobRecord& job) override { return writer_.give_and_wait(update_of(job)); }
  void update(const JobRecord& job, Callback done) override { give(update_of(job), std::move(done)); }
  std::vector<JobRecord> jobs() const override { return cache_.jobs(); }
  std::optional<JobRecord> job(JobId id) const override { return cache_.job(id); }
  void event(JobId job, int64_t at_ms, std::string text) override;
  Expected<std::vector<JobEvent>> events(JobId job) override;
  void pin_class(JobId job, const std::string& numeric_class, Callback done) override;
  Status forget(JobId job) override;
  Expected<std::vector<JobId>> forget_ended(int64_t before_ms) override;

  void commit_result(const UnitCommit& commit, std::shared_ptr<const Bytes> payload, Callback done) override;
  void settle(JobId job, uint64_t unit, const Digest& winner, bool verified, const std::string& worker,
              Callback done) override;
  void revoke_answer(JobId job, uint64_t unit, const Digest& digest, Callback done) override;
  Status conclude(JobId job, const Edit& edit) override;
  void revoke(JobId job, std::vector<uint64_t> units, Callback done) override;
  Expected<std::vector<CommitRow>> commits(JobId job) override;
  Expected<Bytes> read_result(const CommitRow& row) const override { return read_spool_record(spool_, row); }
  Expected<Bytes> read_result(JobId job, uint64_t unit, const Digest& digest) override;
  void drop_results(JobId job, Callback done) override;

  void put_pass(JobId job, const PassRecord& pass, Callback done) override;
  Expected<std::vector<PassRecord>> passes(JobId job) override;

  void put_worker(const WorkerRecord& worker, Callback done) override;
  std::optional<WorkerRecord> worker(const std::string& identity) const override {
    return cache_.worker(identity);
  }
  std::vector<WorkerRecord> workers() const override { return cache_.workers(); }
  void note_trust(const std::string& identity, uint64_t agreed, int64_t at_ms, Callback done) override;
  void quarantine(const std::string& identity, const std::string& reason, int64_t at_ms,
                  Callback done) override;
  Status forgive(const std::string& identity) override;

  Expected<std::vector<JobRecord>> copy_now(const std::filesystem::path& database,
                                            const std::filesystem::path& links) override;

  Status probe() override;
  Status flush() override;
  Status compact() override;
  uint64_t wal_size() const override;
  Expected<std::vector<std::string>> check() override;

 private:
  void give(Operation operation, Callback done) {
    operation.done = std::move(done);
    writer_.give(std::move(operation));
  }
  // Runs `load` inside a read-only transaction and waits for its result.
  template <class Value, class Load>
  Expected<Value> read(const Load& load) {
    Value value;
    Operation operation;
    operation.reads = true;
    operation.apply = [&](GroupTransaction& t) -> Status {
      KILN_TRY(value, load(t));
      return {};
    };
    KILN_TRY_STATUS(writer_.give_and_wait(std::move(operation)));
    return value;
  }
  static Operation update_of(const JobRecord& job);
  static Operation change_of(JobId job, const Edit& edit);
  Status probe_spool();

  const std::filesystem::path folder_, spool_;
  const StoreOptions options_;
  const uint64_t epoch_;
  std::optional<FolderLock> lock_;
  RecordCache cache_;
  RowWindows windows_;
  GroupWriter writer_;
};

}  // namespace kiln

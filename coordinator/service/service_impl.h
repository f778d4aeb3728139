// Internal to coordinator/service. Threads: the farm's (handles clients), the pool's (answers
// requests), one conductor for each active job, the keeper (starts and deletes jobs), the scrubber
// (reads what is stored), the writer of results.
#pragma once

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/observed_time.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/service/audit_log.h"
#include "coordinator/service/durable_results.h"
#include "coordinator/service/event_log.h"
#include "coordinator/service/people.h"
#include "coordinator/service/service.h"
#include "coordinator/service/task_pool.h"

namespace kiln {

class ServiceImpl final : public Service {
 public:
  explicit ServiceImpl(const ServiceSettings& settings) : settings_(settings) {}
  ~ServiceImpl() override { stop(std::chrono::hours(24)); }
  Status open();

  uint16_t port() const override { return farm_->port(); }
  bool stop(std::chrono::milliseconds patience) override;
  std::vector<JobRecord> jobs() override { return store_->jobs(); }
  std::optional<JobRecord> job(JobId id) override { return store_->job(id); }
  std::vector<JobEvent> events_of(JobId id) override {
    return store_->events(id).value_or(std::vector<JobEvent>{});
  }
  std::string held_for() const;
  FarmSource source() override;
  BlobStore::Verified verified() const override { return blobs_->verified(); }

  // For the handlers of requests.
  Store& store() { return *store_; }
  BlobStore& blobs() { return *blobs_; }
  Farm& farm() { return *farm_; }
  TaskPool& pool() { return *pool_; }
  const EventLog& events() const { return *events_; }
  const ServiceSettings& settings() const { return settings_; }
  bool stopping() const { return stopping_; }
  void note(JobId job, const std::string& text);
  int64_t now_ms() const;           // for records, Unix ms
  std::string clock_doubt() const;  // why nothing is collected; empty: the clock is believed
  // The request has been carried out: who asked for what goes to the audit log.
  void audit(const Caller& caller, const std::string& verb, const JsonValue& document,
             const std::string& reply);
  void wake();  // makes the keeper look at the queue
  std::optional<BakeProgress> progress_of(JobId job) const;
  bool is_running(JobId job) const;
  // Changes the record and, if the job is active, the running job.
  Status cancel(JobId job, const std::string& who);
  Status set_paused(JobId job, bool paused);
  Status set_priority(JobId job, int32_t priority);
  Status retry(JobId job);
  Status forgive(const std::string& identity);
  // Reads a result of a job that is done, before it is sent. If it is not what was published, the job is
  // queued again and this fails (kUnavailable), saying so.
  Status check_result(JobId job, const FileRecord& file);

 private:
  // A job that has a conductor.
  struct Active {
    std::thread thread;
    std::atomic<bool> stop{false};       // ends the bake: cancelled, or the service stops
    std::atomic<bool> cancelled{false};  // by a user
    std::atomic<bool> ended{false};
    std::atomic<bool> finishing{false};  // its units are all there
    std::string who;
    std::string unmet;         // BakeReport's
    std::string outcome;       // quality of the map, for people
    std::string verification;  // verification_text
    uint64_t units = 0;
    BakeProgress progress;
    uint64_t progress_at = 0;  // stored() when `preparations` was last set
  };

  // data_report.cpp
  FarmHealth health();
  void measure_data();  // the keeper's, once a minute
  // lost_results.cpp
  // A done job that has it among its results, `asked` if that has: the job that bakes it now. 0: none has.
  Expected<JobId> bake_again(const Digest& lost, JobId asked);
  // service.cpp
  Status take_up_jobs();
  Status open_farm();
  void write_audit(const std::string& line);
  // keeper.cpp
  void keep();
  void begin_jobs();
  void end_waits();
  // scrub.cpp
  void scrub();  // the scrubber's thread
  void scrub_blobs(const ReadPace& pace);
  void scrub_spool(const ReadPace& pace);
  void tell_of_damaged_input(const Digest& lost);
  // retention.cpp
  void start_clock();
  void tend();  // once a second
  void observe_time();
  void obey_acceptance(int64_t wall_ms);
  void collect();
  void date_ends_anew(int64_t now_ms);
  void obey_backup_request();
  int64_t wall_ms() const;
  int64_t steady_ms() const;
  // conductor.cpp
  void conduct(JobId id, Active& active);
  Expected<std::vector<FileRecord>> bake(const JobRecord& job, Active& active);
  Status check_apart(const JobRecord& job, const BakeRequest& request, const Active& active);
  Expected<std::unique_ptr<FarmJob>> open_job(const JobRecord& job, const JobSpec& spec,
                                              const ChunkStore& chunks, Active& active);
  Expected<uint32_t> cut(JobId job, uint32_t pass, uint32_t chosen);
  void on_progress(JobId job, Active& active, const BakeProgress& progress);
  void finish(JobId id, Active& active, const Expected<std::vector<FileRecord>>& outputs);
  bool conclude(JobId id, const Active& active, const std::vector<FileRecord>& outputs);
  Status persist(JobId job, const Store::Edit& edit, const Active& active);  // retries while the disk refuses
  std::filesystem::path work_folder(JobId job) const;

  ServiceSettings settings_;
  ServiceTokens tokens_;
  std::unique_ptr<Store> store_;
  std::unique_ptr<BlobStore> blobs_;
  std::unique_ptr<EventLog> events_;
  std::unique_ptr<AuditLog> audit_;
  std::shared_ptr<DurableResultStore> results_;
  std::unique_ptr<TaskPool> pool_;
  std::unique_ptr<Farm> farm_;
  std::atomic<bool> open_{false}, stopping_{false};
  bool taken_up_ = false;  // the jobs of the last coordinator are queued again
  bool stopped_ = false;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool look_ = true;  // work for the keeper
  std::map<JobId, std::unique_ptr<Active>> active_;
  std::mutex lost_mutex_;
  std::map<Digest, JobId> bakers_;       // lost files, and who bakes them again
  std::map<JobId, int64_t> not_before_;  // steady ms: jobs stopped by a full disk
  std::string held_for_;
  std::thread keeper_, scrubber_;
  std::thread backup_;  // the keeper's
  std::atomic<bool> backing_up_{false};
  std::atomic<uint64_t> damaged_results_{0};  // seen by the scrubber

  mutable std::mutex time_mutex_;
  ObservedTime time_;
  bool doubted_ = false;                                               // was said
  int64_t next_clock_ = 0, next_collection_ = 0, next_idle_look_ = 0;  // steady ms
  int64_t next_measure_ = 0;
  GrowthHistory growth_;  // the keeper's

  mutable std::mutex data_mutex_;
  DataReport data_;
};

}  // namespace kiln

// Internal to coordinator/service. Threads: the farm's (handles clients), the pool's (answers
// requests), one conductor for each active job, the keeper (starts and deletes jobs), the writer of
// results.
#pragma once

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "coordinator/farm/queue/blobs.h"
#include "coordinator/run/bake_run.h"
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
  FarmStatus farm_status() override { return farm_->status(); }
  std::vector<JobRecord> jobs() override { return store_->jobs(); }
  std::optional<JobRecord> job(JobId id) override { return store_->job(id); }
  std::vector<JobEvent> events_of(JobId id) override {
    return store_->events(id).value_or(std::vector<JobEvent>{});
  }
  std::string held_for() const override;
  uint64_t log_bytes() override { return store_->wal_size(); }

  // For the handlers of requests.
  Store& store() { return *store_; }
  BlobStore& blobs() { return *blobs_; }
  Farm& farm() { return *farm_; }
  TaskPool& pool() { return *pool_; }
  const EventLog& events() const { return *events_; }
  const ServiceSettings& settings() const { return settings_; }
  bool stopping() const { return stopping_; }
  void note(JobId job, const std::string& text);
  void wake();  // makes the keeper look at the queue
  std::optional<BakeProgress> progress_of(JobId job) const;
  bool is_running(JobId job) const;
  // Changes the record and, if the job is active, the running job.
  Status cancel(JobId job, const std::string& who);
  Status set_paused(JobId job, bool paused);
  Status set_priority(JobId job, int32_t priority);
  Status retry(JobId job);
  Status forgive(const std::string& identity);

 private:
  // A job that has a conductor.
  struct Active {
    std::thread thread;
    std::atomic<bool> stop{false};       // ends the bake: cancelled, or the service stops
    std::atomic<bool> cancelled{false};  // by a user
    std::atomic<bool> ended{false};
    std::atomic<bool> finishing{false};  // its units are all there
    std::string who;
    std::string unmet;    // BakeReport's
    std::string outcome;  // quality of the map, for people
    BakeProgress progress;
    uint64_t progress_at = 0;  // stored() when `preparations` was last set
  };

  // service.cpp
  Status take_up_jobs();
  Status open_farm();
  // keeper.cpp
  void keep();
  void begin_jobs();
  void end_waits();
  void collect();
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
  std::shared_ptr<DurableResultStore> results_;
  std::unique_ptr<TaskPool> pool_;
  std::unique_ptr<Farm> farm_;
  std::atomic<bool> open_{false}, stopping_{false};
  bool stopped_ = false;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool look_ = true;  // work for the keeper
  std::map<JobId, std::unique_ptr<Active>> active_;
  std::map<JobId, int64_t> not_before_;  // unix ms: jobs stopped by a full disk
  std::string held_for_;
  std::thread keeper_;
};

}  // namespace kiln

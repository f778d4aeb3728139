// The environment of a worker process: sockets, threads, the disk cache, signals.
#pragma once

#include <thread>

#include "common/wire/tls.h"
#include "worker/agent/disk_cache.h"
#include "worker/agent/environment.h"
#include "worker/agent/task_queue.h"

namespace kiln {

class SocketEnvironment : public AgentEnvironment {
 public:
  // `settings` outlives it.
  explicit SocketEnvironment(const AgentSettings& settings);
  // Calls `drain` at SIGTERM, SIGINT or a notice of preemption.
  void watch_for_the_end(std::function<void(const std::string& reason)> drain);
  EventLoop& loop() { return loop_; }

  Timing& timing() override { return *timing_; }
  uint64_t draw() override;
  Hello hello() override;
  void connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) override;
  void classify(const std::string& isa, std::function<void(Expected<std::string>)> done) override;
  void prepare(const JobSpec& job, JobChunks chunks, Prepared done) override;
  void bake(BakeTask task, std::function<void(const Unit&, Expected<UnitResult>)> done) override;
  std::vector<Unit> take_unbegun(const std::function<bool(const Unit&)>& wanted) override;
  size_t queued() const override { return pool_.queued(); }
  std::optional<BakePool::Begun> oldest() const override { return pool_.oldest(); }
  bool has_disk() const override { return disk_ != nullptr; }
  void look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) override;
  void store(const Digest& id, ChunkBytes bytes) override;
  std::string replay_file(uint64_t job, uint64_t unit) const override;
  Status keep_replay(const std::string& file, const std::string& content) override;
  void touch_alive_file() override;

 private:
  const AgentSettings& settings_;
  EventLoop loop_;
  const std::unique_ptr<Timing> timing_ = loop_timing(loop_);
  std::unique_ptr<PreemptionWatch> preemption_;  // posts to the loop: must end first
  std::shared_ptr<const TlsContext> tls_;
  std::unique_ptr<DiskCache> disk_;
  std::function<void(const Unit&, Expected<UnitResult>)> on_baked_;
  BakePool pool_;
  std::unique_ptr<TaskQueue> disk_thread_;
  std::jthread classifier_, preparer_;
};

}  // namespace kiln

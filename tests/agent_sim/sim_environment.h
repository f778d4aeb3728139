// The world of one simulated worker process: links, virtual bake threads, the real disk cache in a folder of
// its machine.
#pragma once

#include <list>

#include "tests/agent_sim/sim_link.h"
#include "worker/agent/agent_impl.h"
#include "worker/agent/disk_cache.h"

namespace kiln::sim {

struct MachineTraits {
  std::string name;
  uint32_t threads = 1;
  int64_t unit_ms = 50;
  std::filesystem::path cache;  // empty: no disk cache
};

// What the world decides for a process.
struct SimHost {
  std::function<void(std::function<void(Expected<std::unique_ptr<Link>>)>)> connect;
  enum class Fate { kBakes, kFails, kHangs };
  std::function<Fate(const Unit&)> fate;
};

class SimEnvironment final : public AgentEnvironment {
 public:
  SimEnvironment(Clockwork& clock, const AgentSettings& settings, const MachineTraits& traits,
                 uint32_t process, SimHost host);
  ProcessTiming& process() { return timing_; }

  Timing& timing() override { return timing_; }
  uint64_t draw() override { return timing_.clock().draw(~uint64_t{0}); }
  Hello hello() override;
  void connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) override { host_.connect(done); }
  void classify(const std::string& isa, std::function<void(Expected<std::string>)> done) override;
  void prepare(const JobSpec& job, JobChunks chunks, Prepared done) override;
  void bake(BakeTask task, std::function<void(const Unit&, Expected<UnitResult>)> done) override;
  std::vector<Unit> take_unbegun(const std::function<bool(const Unit&)>& wanted) override;
  size_t queued() const override { return queue_.size(); }
  std::optional<BakePool::Begun> oldest() const override;
  bool has_disk() const override { return disk_ != nullptr; }
  void look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) override;
  void store(const Digest& id, ChunkBytes bytes) override;
  std::string replay_file(uint64_t job, uint64_t unit) const override;
  Status keep_replay(const std::string&, const std::string&) override { return {}; }
  void touch_alive_file() override {}

 private:
  void begin();
  int64_t some(int64_t ms) {
    return 1 + static_cast<int64_t>(timing_.clock().draw(static_cast<uint64_t>(ms)));
  }

  ProcessTiming timing_;
  const AgentSettings& settings_;
  const MachineTraits traits_;
  const uint32_t process_;
  const SimHost host_;
  std::unique_ptr<DiskCache> disk_;
  std::deque<BakeTask> queue_;
  std::list<BakePool::Begun> begun_;
  std::function<void(const Unit&, Expected<UnitResult>)> on_baked_;
};

// The bake of every simulated machine: a pure function.
std::unique_ptr<Baker> sim_baker(const TransportSettings& settings);

}  // namespace kiln::sim

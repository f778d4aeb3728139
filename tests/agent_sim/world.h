// A farm in one thread and in virtual time: real agents, the real server with its ledger, the real store on a
// simulated disk. The clock, the links, the bake, the disk and all that befalls them obey one seed.
#pragma once

#include <filesystem>

#include "coordinator/farm/dispatch/server.h"
#include "coordinator/farm/queue/store.h"
#include "tests/agent_sim/sim_environment.h"
#include "tests/agent_sim/sim_store.h"

namespace kiln::sim {

struct WorldFigures {
  uint64_t events = 0, kills = 0, restarts = 0, cuts = 0, stalls = 0, results = 0, resent = 0, twice = 0,
           lost_blocks = 0, rotten = 0, refused_writes = 0, rewinds = 0, hung = 0, drained = 0,
           failed_jobs = 0;
  int64_t simulated_ms = 0;
  WorldFigures& operator+=(const WorldFigures& o);
  std::string words() const;
};

class World {
 public:
  // `folder` is made and removed: keep it on a disk without a disk, as /dev/shm.
  World(uint64_t seed, std::filesystem::path folder);
  ~World();
  // Faults for a while, then none; ends when every job has. The sentence of the first broken promise, or
  // nothing.
  std::string run();
  const WorldFigures& figures() const { return figures_; }
  void trace(bool on) { trace_ = on; }

 private:
  using Key = std::pair<JobId, uint64_t>;
  struct SimJob {
    JobSpec spec;
    ChunkStore chunks;
    uint32_t quorum = 1;
    std::vector<std::vector<WorkUnit>> passes;
    std::vector<std::shared_ptr<const Bytes>> caches;  // of each pass; null: none
    bool poisoned = false;                             // its first unit fails everywhere
    // Of the present run.
    std::shared_ptr<JobPort> port;
    std::shared_ptr<const PassUnits> units;
    size_t pass = 0;
    std::map<uint64_t, Digest> merged;
    std::string ended;  // how
  };
  struct Traffic {  // of one agent process, for the promises about it
    std::map<Key, std::pair<uint64_t, Digest>>
        kept;                                 // results sent and not acknowledged: the link, the digest
    std::set<std::pair<uint64_t, Key>> sent;  // link, unit; since the unit was last given on it
    uint64_t link = 0;
  };
  struct Machine {
    MachineTraits traits;
    AgentSettings settings;
    std::unique_ptr<SimEnvironment> environment;
    std::unique_ptr<Agent> agent;
    Traffic traffic;
    std::weak_ptr<SimWire> wire;
    int hung = 0;
  };

  // world.cpp: the coordinator
  void make_jobs();
  void start_coordinator();
  void kill_coordinator();
  void tick();
  void conduct(SimJob& job);
  void begin_pass(SimJob& job);
  void deliver(SimJob& job, const DeliveredUnit& delivered);
  void end_job(SimJob& job, const std::string& how);
  void check_stored();
  Digest truth(const SimJob& job, const WorkUnit& unit) const;
  void fail(const std::string& sentence);

  // machines.cpp: the workers and what befalls all
  void make_machines();
  void start_agent(size_t i);
  void end_agent(size_t i, int64_t back_ms);
  void look_after(size_t i);
  void connect(size_t i, std::function<void(Expected<std::unique_ptr<Link>>)> done);
  LinkWatch watch(size_t i);
  void on_sent(size_t i, uint64_t link, const Message& message);
  void on_delivered(size_t i, uint64_t link, const Message& message);
  void print(size_t i, const char* arrow, const Message& message) const;
  void expect_resent(size_t i, uint64_t link);
  void make_trouble();

  const uint64_t seed_;
  const std::filesystem::path folder_;
  Clockwork clock_;
  SimDisk disk_;
  std::map<JobId, SimJob> jobs_;
  std::vector<Machine> machines_;
  std::set<std::tuple<JobId, uint64_t, Digest>> acknowledged_;
  std::set<Key> damaged_;  // results that the disk spoilt: they may be baked again
  bool rotting_ = false, lying_ = false;

  FarmSettings settings_;
  std::unique_ptr<Store> store_;
  std::unique_ptr<ProcessTiming> coordinator_;  // null: it is down
  std::unique_ptr<SimStore> results_;
  std::unique_ptr<Server> server_;
  uint64_t next_link_ = 1;
  uint32_t next_process_ = 1;
  int64_t faults_end_ = 0;
  std::string failure_;
  WorldFigures figures_;
  bool trace_ = false;
};

}  // namespace kiln::sim

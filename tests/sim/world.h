// The farm's ledger in a simulated world: clock, disk, network, workers and conductors that all obey one
// seed.
//
// The ledger is the product's; everything around it is the smallest thing that fails like the real one. The
// disk loses what was not flushed when the coordinator is killed and refuses writes while it is full; links
// delay, stall, break and repeat; workers die, hang, lie, come back and answer late; the coordinator's clock
// leaps, and after a restart a part of what was stored may be gone; jobs fail in their import or are
// cancelled.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln::sim {

struct WorldSize {
  uint32_t workers = 0, jobs = 0, units = 0;  // 0: drawn; units are of one pass
};

struct WorldFigures {
  uint64_t events = 0, grants = 0, answers = 0, kills = 0, restarts = 0, lies = 0, quarantined = 0,
           rewinds = 0, waived = 0, refused_writes = 0, skipped = 0, rotten = 0, leaps = 0, torn = 0,
           cut_short = 0;
  int64_t simulated_ms = 0;
};

class World {
 public:
  explicit World(uint64_t seed, const WorldSize& size = {});
  // Faults for a while, then none; ends when every job has. The sentence of the first broken promise, or
  // nothing.
  std::string run();
  const WorldFigures& figures() const { return figures_; }
  void trace(bool on) { trace_ = on; }
  // Of every action of the ledger with its time, and of what it says of itself now and then (`why`, counts,
  // views): equal digests are equal conduct. Slow: keep it off but to compare.
  void digest(bool on) { digest_on_ = on; }
  uint64_t digest() const { return digest_; }

 private:
  using Key = std::pair<JobId, uint64_t>;
  struct Row {  // of the disk
    Digest digest;
    uint64_t shape = 0;
    std::string identity;
    bool settled = false, verified = false;
  };
  struct Disk {
    std::map<Key, std::vector<Row>> rows;
    std::map<std::string, uint64_t> agreed;
    std::map<std::string, std::string> quarantined;
    std::map<JobId, std::string> classes;
    std::set<JobId> done;
  };
  struct Conductor {
    JobTraits traits;
    std::vector<std::vector<UnitPlan>> passes;
    size_t pass = 0;
    std::map<uint64_t, Digest> merged;
    std::set<uint64_t> skipped;
    std::set<uint64_t> rotten;  // delivered, but the disk gave other bytes back
    uint64_t run = 0;           // a restart or rewind begins a new one
    int64_t ends_at = -1;       // it is cancelled then; -1: it is not
    bool importing = false;     // until it is cancelled: it has no pass
  };
  struct Kept {
    JobId job;
    uint64_t unit, lease;
    Digest digest;
    bool sent = false;
  };
  struct Machine {
    WorkerTraits traits;
    std::string numeric_class;
    int64_t unit_ms = 10;
    bool alive = true, liar = false, contrary = false;
    bool hung = false;  // it has a unit that will never end
    uint32_t ring = 0;  // liars of one owner, who tell the same lies; 0: on its own
    uint64_t link = 0;  // number of the connection; 0: none
    int64_t stalled_until = 0;
    JobId job = 0;
    std::deque<Grant> queue;
    std::vector<Grant> running;
    std::vector<Kept> kept;
    uint64_t process = 0;  // new after a crash
  };

  // world.cpp: what happens.
  void at(int64_t when, std::function<void()> what);
  void fail(const std::string& sentence);
  void make_jobs(const WorldSize& size);
  void make_machines(const WorldSize& size);
  void start_coordinator();
  void kill_coordinator();
  void tear_disk();
  void cut_short(JobId job);
  void begin(JobId job);
  void perform(const Actions& actions);
  void carry_out(const Action& action);
  void check_published(JobId job);
  void note_waived();
  void mix(const std::string& words);
  void mix_state();
  Digest truth(JobId job, uint64_t unit) const;
  bool of_ring(const std::string& identity) const;
  bool poison(JobId job, uint64_t unit) const { return poison_.count({job, unit}) > 0; }

  // machines.cpp: the disk
  void write(std::function<void(Disk&)> change, std::function<void()> then);
  void flush();

  // machines.cpp: the machines
  void connect(size_t machine);
  void cut(size_t machine, bool crashed);
  void to_machine(WorkerId worker, std::function<void(Machine&, size_t)> what);
  void to_coordinator(size_t machine, std::function<void(Actions&)> what);
  void work(size_t machine);
  void finished(size_t machine, const Grant& grant);
  void echo(size_t machine, JobId job, uint64_t unit, const Digest& digest);
  void take_result(WorkerId worker, JobId job, uint64_t unit, const Digest& digest, Actions& out);
  void deliver_kept(size_t machine, JobId job);
  void heartbeat(size_t machine);
  void crash(size_t machine);
  void vanish(size_t machine);
  void notice_break(WorkerId worker, bool crashed, uint64_t process);
  bool count_losses(WorkerId worker, uint64_t process);
  void forget_losses(uint64_t process);
  bool may_lose(const Grant& grant);
  // What the coordinator takes for the time.
  int64_t clock() const { return now_ + clock_ahead_; }
  // As much as this can have passed for the coordinator, at most.
  int64_t longest_ms() const { return now_ + leapt_; }
  void leap();
  void end_process(size_t machine, bool crashed);
  void make_trouble();

  uint64_t draw(uint64_t below) { return below ? random_() % below : 0; }
  bool chance(double share) { return static_cast<double>(random_() >> 11) * 0x1p-53 < share; }

  std::mt19937_64 random_;
  uint64_t seed_;
  FarmRules rules_;
  std::unique_ptr<FarmLedger> ledger_;
  uint64_t epoch_ = 0;  // of the coordinator
  uint64_t performed_ = 0, audit_every_ = 1;
  bool up_ = false;
  int64_t now_ = 0, faults_end_ = 0;
  int64_t clock_ahead_ = 0, leapt_ = 0;
  struct Event {
    int64_t when;
    uint64_t number;
    std::function<void()> what;
    bool operator<(const Event& o) const { return std::tie(o.when, o.number) < std::tie(when, number); }
  };
  std::priority_queue<Event> events_;
  uint64_t next_event_ = 0, next_link_ = 1, next_process_ = 1;
  WorkerId next_worker_ = 1;

  Disk disk_;
  struct Write {
    std::function<void(Disk&)> change;
    std::function<void()> then;
  };
  std::vector<Write> unflushed_;
  bool flushing_ = false, full_ = false;

  std::vector<Machine> machines_;
  std::map<WorkerId, size_t> machine_of_;  // of the present epoch
  std::map<WorkerId, uint64_t> process_of_;
  std::map<WorkerId, int64_t> heard_at_;
  std::map<uint64_t, WorkerId> worker_of_;  // by link
  std::map<JobId, Conductor> conductors_;
  std::set<Key> poison_;
  // What each connected worker may hold by the coordinator's book: at least what the ledger says it holds.
  std::map<WorkerId, std::set<Key>> granted_;
  std::map<Key, int> lost_;  // times that a unit failed, hung, or was in the hands of a worker that was lost
  struct Lost {
    uint64_t process;
    int64_t when;
    Key unit;
  };
  std::vector<Lost> may_return_;  // counted in lost_, but the process may yet come back
  std::set<JobId> waived_;        // jobs with results that nobody else could confirm
  std::string failure_;
  WorldFigures figures_;
  bool trace_ = false, digest_on_ = false, honest_enough_ = true;
  uint64_t digest_ = 0;
};

}  // namespace kiln::sim

// Internal to worker/agent. Everything runs on the loop's thread; what others do is the environment's.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>

#include "worker/agent/cache_shelf.h"
#include "worker/agent/environment.h"
#include "worker/agent/job_fetch.h"

namespace kiln {

class Agent {
 public:
  // `environment` outlives it.
  Agent(const AgentSettings& settings, AgentEnvironment& environment);
  void start();
  // How it ended, once it has.
  const std::optional<Status>& end() const { return end_; }
  // Finishes running units, hands the others back and ends.
  void drain(const std::string& reason);
  bool idle() const { return taken_.empty() && !preparing_; }

 private:
  // An active job from the coordinator. Several may be ready; the last one received is current.
  struct KnownJob {
    KnownJob(JobSpec s, const ChunkCache& cache) : spec(std::move(s)), fetch(spec, cache) {}
    JobSpec spec;
    JobFetch fetch;
    std::unordered_set<Digest> awaited;  // chunks being read from disk or requested
    std::string numeric_class;           // once known
    uint64_t class_told = 0;             // connection on which the coordinator was told it; 0: none
    std::shared_ptr<const Baker> baker;  // when it is ready
    std::unordered_set<Digest> chunks;   // all chunks it needs, when it is ready
    CacheShelf caches;                   // while it is ready
    uint64_t bytes = 0;                  // ready_bytes()
    uint64_t last_use = 0;
    std::map<uint64_t, Result> kept;  // by unit, until acknowledged
  };
  struct TakenUnit {  // a unit held here: waiting for its cache, queued or running
    uint64_t lease = 0;
    bool withdrawn = false;
    WorkUnit unit;
  };
  using UnitKey = std::pair<uint64_t, uint64_t>;  // job, unit

  // agent.cpp: the connection.
  void connect();
  void on_connected(Expected<std::unique_ptr<Link>> link);
  void retry(const std::string& reason);
  void on_frame(const FrameHeader& header, std::span<const std::byte> payload);
  void on_closed(const std::string& reason);
  void handle(Message& message);
  void greet(const Welcome& welcome);
  void set_pace(uint32_t heartbeat_ms);
  void beat();
  void watch();
  void send(const Message& message);
  void break_connection(const std::string& reason);  // the coordinator broke the protocol: reconnect
  void finish(Status end);
  void leave_if_drained();

  // agent_jobs.cpp: loading and evicting jobs.
  void start_job(const Job& job);
  void end_job(uint64_t job, const std::string& reason);
  KnownJob* current();
  KnownJob* known(uint64_t job);
  void classify(uint64_t job, const std::string& isa);
  void on_class(uint64_t job, const std::string& isa, Expected<std::string> name);
  void fetch();
  void request(const std::vector<Digest>& ids);
  void on_looked_up(uint64_t job, uint64_t connection, const std::vector<Digest>& ids,
                    const std::vector<ChunkBytes>& found);
  void on_piece(const ChunkPiece& piece);
  bool make_room(uint64_t bytes);  // for the current job; false: the others are in use
  void prepare();
  void on_prepared(uint64_t job, Expected<std::shared_ptr<const Baker>> baker);
  void fail_job(uint64_t job, const Error& error);
  void forget_unready();

  // agent_units.cpp: units and results.
  void offer();  // reports the current job ready and delivers its kept results
  void tell_class(KnownJob& job);
  void grant(const KnownJob& job);
  void take_unit(Unit& unit);
  void begin(const KnownJob& job, Unit unit, std::shared_ptr<const SharedCache> cache);
  void on_done(const Unit& unit, Expected<UnitResult> result);
  void report_failure(const UnitKey& key, const TakenUnit& taken, const Error& error);
  std::string keep_replay(const UnitKey& key, const WorkUnit& unit);  // the line to paste, or ""
  void keep(KnownJob& job, const TakenUnit& taken, UnitResult result);
  void deliver_again(uint64_t job);
  void pump();
  void on_ack(const CommitAck& ack);
  void withdraw(const Withdraw& withdraw);
  void drop_kept(KnownJob& job, uint64_t unit);
  void drop_taken(uint64_t job, const std::function<bool(uint64_t unit)>& wanted);
  void settle_credits();
  void stop_if_stuck();
  std::vector<Unit> take_unbegun(const std::function<bool(const Unit&)>& wanted);

  // agent_caches.cpp: units that wait for an irradiance cache.
  void feed_waiting();
  std::shared_ptr<const SharedCache> shelve(KnownJob& job, const Digest& id);  // null: not in memory
  void on_caches_looked_up(uint64_t connection, const std::vector<Digest>& ids,
                           const std::vector<ChunkBytes>& found);
  void stop_waiting(const std::function<bool(const Unit&)>& wanted);

  const AgentSettings settings_;
  AgentEnvironment& environment_;
  Timing& timing_;
  const std::unique_ptr<Alarm> retry_, heartbeat_, watch_, drain_limit_;
  std::unique_ptr<Link> connection_;
  std::optional<Status> end_;
  std::optional<Status> leaving_;  // becomes the final status once the queue has been sent
  uint64_t instance_;
  int64_t last_contact_ms_ = 0;
  uint32_t failures_ = 0;          // to connect, in a row
  uint64_t connection_count_ = 0;  // identifies answers to an earlier connection
  uint32_t heartbeat_ms_ = 1000, beats_ = 0;
  bool welcomed_ = false, draining_ = false;

  ChunkCache cache_;
  std::unordered_set<Digest> asked_;  // ever, on this connection
  std::map<uint64_t, KnownJob> jobs_;
  std::optional<uint64_t> current_;
  std::optional<uint64_t> preparing_;
  uint64_t uses_ = 0;
  std::map<std::string, std::string> classes_;  // by kernels; of this machine
  std::map<UnitKey, TakenUnit> taken_;
  std::deque<Unit> waiting_;                   // units of ready jobs waiting for caches, in arrival order
  std::unordered_set<Digest> awaited_caches_;  // being read from disk or requested on this connection
  uint64_t kept_bytes_ = 0;
  bool full_ = false;               // kept results exceed the limit: request no units
  std::set<uint64_t> undelivered_;  // jobs with kept results when the connection started
  std::deque<UnitKey> outbox_;
};

}  // namespace kiln

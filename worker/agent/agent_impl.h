// Internal to worker/agent. Everything runs on the loop's thread but the bake threads and the thread that
// makes a job ready; those reach the loop by post().
#pragma once

#include <map>
#include <optional>
#include <thread>

#include "common/base/clock.h"
#include "common/wire/listener.h"
#include "worker/agent/agent.h"
#include "worker/agent/bake_pool.h"
#include "worker/agent/job_fetch.h"

namespace kiln {

class Agent {
 public:
  explicit Agent(const AgentSettings& settings);
  Status run();
  bool idle() const { return running_ == 0 && !preparing_; }

 private:
  // agent.cpp: the connection.
  void connect();
  void on_connected(Expected<std::unique_ptr<Connection>> connection);
  void retry(const std::string& reason);
  void send_hello();
  void on_frame(const FrameHeader& header, std::span<const std::byte> payload);
  void on_closed(const std::string& reason);
  void handle(Message& message);
  void greet(const Welcome& welcome);
  void beat();
  void send(const Message& message);
  void break_connection(const std::string& reason);  // the coordinator broke the protocol: connect anew
  void finish(Status end);
  void drain(const std::string& reason);
  void leave_if_drained();

  // agent_jobs.cpp: jobs and units.
  void start_job(const Job& job);
  void start_waiting_job();
  void on_class(uint64_t job, Expected<std::string> name);
  void fetch();
  void on_piece(const ChunkPiece& piece);
  void prepare();
  void on_prepared(uint64_t job, Expected<std::shared_ptr<const Baker>> baker);
  void offer();  // says that the job is ready and delivers what is kept
  void fail_job(const Error& error);
  void take_unit(Unit& unit);
  void on_done(const Unit& unit, Expected<UnitResult> result);
  void deliver(const Unit& unit, Expected<UnitResult> result);
  void on_ack(const CommitAck& ack);

  const AgentSettings& settings_;
  SteadyClock clock_;
  EventLoop loop_;
  Timer retry_, heartbeat_, drain_limit_;
  std::unique_ptr<Connection> connection_;
  std::optional<Status> end_;
  uint64_t instance_;
  int64_t last_contact_ms_ = 0;
  uint32_t failures_ = 0;  // to connect, in a row
  uint32_t heartbeat_ms_ = 1000;
  bool welcomed_ = false, draining_ = false;

  ChunkCache cache_;
  std::optional<JobSpec> job_;
  std::optional<JobFetch> fetch_;
  std::string class_;               // of the job, once known
  std::unique_ptr<BakePool> pool_;  // present when the job is ready
  bool preparing_ = false;
  std::optional<Job> waiting_job_;   // another job, until the threads are free
  size_t running_ = 0;               // units taken and not yet done
  std::map<uint64_t, Result> kept_;  // by unit, until acknowledged
  std::jthread classifier_, preparer_;
};

}  // namespace kiln

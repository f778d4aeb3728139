// One worker's connection: hand-shake, chunks on request, and messages turned into calls of the host.
#pragma once

#include <deque>
#include <memory>

#include "common/scene/prepared.h"
#include "common/wire/connection.h"
#include "common/wire/event_loop.h"
#include "coordinator/dispatch/ledger.h"

namespace kiln {

class Session;

// What a session needs of the coordinator. Calls come from the loop, one at a time.
class SessionHost {
 public:
  virtual ~SessionHost() = default;
  // Checks the token and the history of the worker; yields its number, or why it is refused.
  virtual Expected<WorkerId> admit(const Hello& hello, Session& session) = 0;
  virtual Welcome welcome(WorkerId worker) const = 0;
  virtual const JobSpec& job() const = 0;
  virtual const Bytes* chunk(const Digest& id) const = 0;
  virtual void on_heard(Session& session) = 0;
  virtual void on_ready(Session& session, const std::string& numeric_class, uint32_t credits) = 0;
  virtual void on_job_failed(Session& session, const JobFailed& failed) = 0;
  virtual void on_result(Session& session, Result&& result) = 0;
  virtual void on_unit_failed(Session& session, const UnitFailed& failed) = 0;
  virtual void on_drain(Session& session, const Drain& drain) = 0;
  // Last call. `orderly`: the worker said goodbye or we told it to go.
  virtual void on_closed(Session& session, bool orderly, const std::string& reason) = 0;
};

class Session {
 public:
  Session(EventLoop& loop, SessionHost& host, std::unique_ptr<Connection> connection);
  void start();
  void send(const Message& message) { connection_->send(message); }
  void refuse(const std::string& reason);   // tells the worker why, then closes
  void goodbye(const std::string& reason);  // closes in order

  WorkerId worker() const { return worker_; }  // 0 before the hand-shake
  const std::string& name() const { return name_; }
  uint32_t threads() const { return hello_.threads; }

 private:
  void on_frame(const FrameHeader& header, std::span<const std::byte> payload);
  void handle(Message& message);
  void greet(Hello& hello);
  void request(const ChunkRequest& request);
  void serve_chunks();
  bool of_this_job(uint64_t job);

  SessionHost& host_;
  std::unique_ptr<Connection> connection_;
  Timer hand_shake_;
  Hello hello_;
  WorkerId worker_ = 0;
  std::string name_;
  std::string class_;
  bool orderly_ = false;
  std::deque<Digest> wanted_;  // the front is being sent
  uint64_t sent_ = 0;          // of the front
  bool compress_ = false;
};

}  // namespace kiln

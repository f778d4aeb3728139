// One peer's connection, worker or client: the handshake, chunks on request, and messages turned into calls
// of the host.
#pragma once

#include <deque>
#include <map>
#include <memory>

#include "common/scene/prepared.h"
#include "common/wire/link.h"
#include "common/wire/timing.h"
#include "coordinator/farm/dispatch/client_talk.h"
#include "coordinator/farm/ledger/rules.h"

namespace kiln {

class Session;

// The coordinator as seen by a session. Calls come from the loop, one at a time.
class SessionHost {
 public:
  virtual ~SessionHost() = default;
  // Checks the worker's token, certificate and history; returns its number, or why it is refused.
  virtual Expected<WorkerId> admit(const Hello& hello, Session& session) = 0;
  virtual Welcome welcome(WorkerId worker) const = 0;
  virtual void on_admitted(Session& session) = 0;  // Welcome has been queued
  virtual Expected<std::unique_ptr<ClientTalk>> admit_client(const ClientHello& hello, Session& session) = 0;
  // Whether the session was parted from since, because its certificate was revoked. Asked before anything is
  // taken from the peer or handed to it.
  virtual bool cut_off(Session& session) = 0;
  virtual const Bytes* chunk(const Digest& id) const = 0;
  virtual void on_heard(Session& session) = 0;
  virtual void on_class(Session& session, const JobClass& message) = 0;
  virtual void on_ready(Session& session, const std::string& numeric_class, const Credits& credits) = 0;
  virtual void on_job_failed(Session& session, const JobFailed& failed) = 0;
  virtual void on_result(Session& session, Result&& result) = 0;
  virtual void on_unit_failed(Session& session, const UnitFailed& failed) = 0;
  virtual void on_drain(Session& session, const Drain& drain) = 0;
  // Last call. `orderly`: either side said goodbye.
  virtual void on_closed(Session& session, bool orderly, const std::string& reason) = 0;
};

class Session final : public ClientLink {
 public:
  Session(Timing& timing, SessionHost& host, std::unique_ptr<Link> link);
  void start();
  void send(const Message& message) override;
  size_t queued_bytes() const override { return connection_->queued_bytes(); }
  const std::string& peer() const override { return peer_; }
  void refuse(const std::string& reason);  // tells the peer why, then closes
  void cut(const std::string& reason);     // the same, at once: what waits to be sent is dropped
  bool is_cut() const { return cut_; }
  void goodbye(const std::string& reason);  // closes in order

  WorkerId worker() const { return worker_; }  // 0: not a worker, or before the handshake
  bool is_client() const { return talk_ != nullptr; }
  const std::string& name() const { return name_; }
  const Hello& hello() const { return hello_; }  // without its token
  const PeerIdentity& identity() const { return connection_->peer_identity(); }
  std::string caller() const { return connection_->caller(); }
  bool loopback() const { return connection_->loopback(); }

 private:
  void on_frame(const FrameHeader& header, std::span<const std::byte> payload);
  void handle(Message& message);
  void handle_client(Message& message);
  void expect_client();
  std::string known_as(const std::string& host) const;
  void greet(Hello& hello);
  void greet_client(ClientHello& hello);
  void request(const ChunkRequest& request);
  void serve_chunks();

  SessionHost& host_;
  std::unique_ptr<Link> connection_;
  const std::unique_ptr<Alarm> patience_;  // for the Hello, then for a client's next message
  Hello hello_;
  WorkerId worker_ = 0;
  std::string peer_, name_;
  std::map<uint64_t, std::string> classes_;  // by job
  bool orderly_ = false, cut_ = false;
  std::unique_ptr<ClientTalk> talk_;
  std::deque<Digest> wanted_;  // the front is being sent
  uint64_t sent_ = 0;          // of the front
  bool compress_ = false;
};

}  // namespace kiln

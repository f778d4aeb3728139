// The coordinator's end of all workers: accepts them, feeds what they say to the ledger and does what the
// ledger answers. One thread, the loop's.
#pragma once

#include <functional>
#include <map>
#include <optional>

#include "common/base/clock.h"
#include "common/wire/listener.h"
#include "coordinator/dispatch/farm.h"
#include "coordinator/dispatch/session.h"

namespace kiln {

class Server final : public SessionHost {
 public:
  using OnResult = std::function<Status(const WorkUnit&, const UnitResult&)>;

  Server(EventLoop& loop, const FarmSettings& settings, const JobSpec& job, const ChunkStore& chunks);
  Status listen();
  uint16_t port() const { return listener_->port(); }

  void begin_pass(std::vector<WorkUnit> units, const OnResult& on_result);
  void end_pass();
  bool pass_complete() const { return ledger_.complete(); }
  const std::optional<Error>& pass_error() const { return pass_error_; }
  uint64_t units_done() const { return ledger_.committed(); }
  uint32_t workers_present() const { return ledger_.present(); }
  size_t connections() const { return sessions_.size(); }

  void tick();
  void note(const std::string& text);
  void dismiss_all(const std::string& reason);  // says goodbye to everyone and accepts nobody new
  const FarmStatistics& statistics();

 private:
  Expected<WorkerId> admit(const Hello& hello, Session& session) override;
  Welcome welcome(WorkerId worker) const override;
  const JobSpec& job() const override { return job_; }
  const Bytes* chunk(const Digest& id) const override { return chunks_.find(id); }
  void on_heard(Session& session) override;
  void on_ready(Session& session, const std::string& numeric_class, uint32_t credits) override;
  void on_job_failed(Session& session, const JobFailed& failed) override;
  void on_result(Session& session, Result&& result) override;
  void on_unit_failed(Session& session, const UnitFailed& failed) override;
  void on_drain(Session& session, const Drain& drain) override;
  void on_closed(Session& session, bool orderly, const std::string& reason) override;

  Session* session_of(WorkerId worker);
  void perform(const Actions& actions, const UnitResult* result = nullptr);
  void commit(const WorkUnit& unit, const UnitResult& result);
  void expel(WorkerId worker, const std::string& reason);

  EventLoop& loop_;
  const FarmSettings& settings_;
  const JobSpec& job_;
  const ChunkStore& chunks_;
  SteadyClock clock_;
  Ledger ledger_;
  std::unique_ptr<Listener> listener_;
  std::map<Session*, std::unique_ptr<Session>> sessions_;
  std::map<WorkerId, Session*> by_worker_;
  std::map<uint64_t, WorkerId> by_instance_;  // a process that reconnects is the same worker
  std::map<WorkerId, std::string> expelled_;  // for what
  WorkerId last_worker_ = 0;

  std::unordered_map<uint64_t, WorkUnit> units_;  // of this pass
  OnResult on_result_;
  std::optional<Error> pass_error_;
  uint32_t plane_count_ = 0;
  FarmStatistics statistics_;
};

}  // namespace kiln

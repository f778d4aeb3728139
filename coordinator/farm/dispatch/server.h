// The coordinator's end of all connections: accepts them, feeds their messages to the ledger and carries out
// the ledger's actions. Runs on the loop's thread only.
#pragma once

#include <deque>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "common/wire/listener.h"
#include "coordinator/farm/dispatch/farm_port.h"
#include "coordinator/farm/dispatch/session.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

class Server final : public SessionHost {
 public:
  Server(Timing& timing, const FarmSettings& settings, ResultStore& store);
  ~Server() override;
  Status listen(EventLoop& loop);
  void accept(std::unique_ptr<Link> link);
  uint16_t port() const { return listener_->port(); }
  size_t connections() const { return sessions_.size(); }

  // server_jobs.cpp
  Status open_job(const FarmJobSpec& job, std::shared_ptr<JobPort> port);
  void close_job(JobId job);
  void change_job(JobId job, int32_t priority, bool paused);
  void add_chunk(JobId job, const Digest& id, std::shared_ptr<const Bytes> bytes);
  void keep_chunks(JobId job, const std::set<Digest>& ids);  // among the added chunks
  void begin_pass(JobId job, std::shared_ptr<const PassUnits> units);
  void end_pass(JobId job);
  void fail_job(JobId job, const Error& error);
  void fail_all(const Error& error);
  void damaged(JobId job, uint64_t unit, const std::string& why);
  void hold(bool on, const std::string& reason);
  FarmStatistics statistics(JobId job);
  FarmStatus status() const;
  std::vector<std::string> why_worker(const std::string& number_or_name) const;

  void tick();
  void note(JobId job, const std::string& text);
  void dismiss_all(const std::string& reason);  // dismisses all workers and accepts no more
  FarmLedger& ledger() { return ledger_; }

 private:
  struct OpenJob {
    JobSpec spec;
    const ChunkStore* chunks = nullptr;
    std::map<Digest, std::shared_ptr<const Bytes>> added;  // chunks of the pass
    std::shared_ptr<JobPort> port;
    std::shared_ptr<const PassUnits> units;
    MomentLayout layout;
    uint64_t rays = 0;
    std::deque<std::string> events;
    bool resumed = false;  // started by an earlier coordinator
    std::vector<std::pair<WorkerId, Result>>
        parked;  // results of units that do not exist yet, after a restart
  };
  struct Member {  // a connected worker
    Session* session = nullptr;
    std::string identity, owner;  // WorkerTraits'
    uint64_t instance = 0;
    uint64_t units = 0, failed = 0, rays = 0;
    std::deque<std::pair<int64_t, uint64_t>> recent;  // (when, rays) of the last minute
  };
  using AnswerKey = std::tuple<JobId, uint64_t, Digest>;
  // Callbacks of the store outlive the server.
  struct Alive {
    std::mutex mutex;
    Timing* timing;
  };

  // server_admission.cpp
  Expected<std::string> owner_of(const Hello& hello, const Session& session) const;
  std::string voter_of(const Member& member) const;
  Expected<WorkerId> admit(const Hello& hello, Session& session) override;
  Welcome welcome(WorkerId worker) const override;
  void on_admitted(Session& session) override;
  Expected<std::unique_ptr<ClientTalk>> admit_client(const ClientHello& hello, Session& session) override;
  bool cut_off(Session& session) override;
  void cut_off_revoked();

  const Bytes* chunk(const Digest& id) const override;
  void on_heard(Session& session) override;
  void on_class(Session& session, const JobClass& message) override;
  void on_ready(Session& session, const std::string& numeric_class, const Credits& credits) override;
  void on_job_failed(Session& session, const JobFailed& failed) override;
  void on_result(Session& session, Result&& result) override;
  void on_unit_failed(Session& session, const UnitFailed& failed) override;
  void on_drain(Session& session, const Drain& drain) override;
  void on_closed(Session& session, bool orderly, const std::string& reason) override;

  Session* session_of(WorkerId worker) const;
  OpenJob* find_job(JobId job);
  void fail_if_refused_by_all(JobId job, const std::string& reason);
  void give(WorkerId worker, const kiln::Unit& unit);
  void take_result(WorkerId worker, OpenJob& job, Result&& result);

  // server_actions.cpp
  void perform(Actions&& actions);
  void carry_out(const Action& action);
  void store(const StoreAnswer& answer);
  void on_stored(const StoreAnswer& answer);
  enum class Parting { kRefuse, kCut };
  void expel(WorkerId worker, const std::string& reason, Parting parting = Parting::kRefuse);

  Timing& timing_;
  const FarmSettings& settings_;
  ResultStore& store_;
  FarmLedger ledger_;
  std::unique_ptr<Listener> listener_;
  const std::shared_ptr<ReceiveBudget> memory_ = ReceiveBudget::make(kReceiveBytes, kReceiveBytesOfCaller);
  std::list<std::unique_ptr<Session>> sessions_;  // in the order in which they came
  std::map<WorkerId, Member> members_;
  std::map<uint64_t, std::string> expelled_;  // processes and reasons
  std::map<JobId, OpenJob> jobs_;
  WorkerId last_worker_ = 0;

  std::deque<Action> todo_;
  bool performing_ = false;
  std::map<AnswerKey, std::shared_ptr<const UnitResult>> arrived_;  // received, not on disk yet
  uint64_t parked_bytes_ = 0;
  size_t revocations_ = 0;  // that all sessions were held against
  std::string held_for_;
  uint64_t results_ = 0, rays_ = 0, ended_duplicates_ = 0, refused_ = 0, expelled_count_ = 0;
  std::shared_ptr<Alive> alive_;
  const std::thread::id thread_ = std::this_thread::get_id();
};

}  // namespace kiln

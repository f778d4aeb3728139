#include "coordinator/dispatch/server.h"

#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/basis/basis.h"
#include "coordinator/dispatch/result_check.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxThreads = 4096;
constexpr size_t kMaxEvents = 10000;  // for the report

}  // namespace

Server::Server(EventLoop& loop, const FarmSettings& settings, const JobSpec& job, const ChunkStore& chunks)
    : loop_(loop),
      settings_(settings),
      job_(job),
      chunks_(chunks),
      ledger_({settings.lease_ms, settings.max_attempts, settings.duplicate_every_unit}),
      plane_count_(static_cast<uint32_t>(moment_plane_names(job.transport.basis).size())) {}

Status Server::listen() {
  KILN_TRY(listener_, Listener::open(loop_, settings_.listen_host, settings_.listen_port,
                                     [this](std::unique_ptr<Connection> connection) {
                                       auto session =
                                           std::make_unique<Session>(loop_, *this, std::move(connection));
                                       Session& started = *session;
                                       sessions_.emplace(&started, std::move(session));
                                       started.start();
                                     }));
  return {};
}

void Server::begin_pass(std::vector<WorkUnit> units, const OnResult& on_result) {
  units_.clear();
  on_result_ = on_result;
  std::vector<uint64_t> ids;
  for (WorkUnit& unit : units) {
    ids.push_back(unit.id);
    units_.emplace(unit.id, std::move(unit));
  }
  Actions actions;
  ledger_.begin_pass(ids, clock_.now_ms(), actions);
  perform(actions);
}

void Server::end_pass() {
  ledger_.end_pass();
  units_.clear();
  on_result_ = nullptr;
}

void Server::tick() {
  Actions actions;
  ledger_.tick(clock_.now_ms(), actions);
  perform(actions);
}

void Server::note(const std::string& text) {
  log_info(text);
  if (statistics_.events.size() < kMaxEvents) statistics_.events.push_back(text);
}

void Server::dismiss_all(const std::string& reason) {
  listener_.reset();
  for (auto& [key, session] : sessions_) session->goodbye(reason);
}

const FarmStatistics& Server::statistics() {
  statistics_.duplicates = ledger_.duplicates();
  statistics_.reassigned = ledger_.reassigned();
  statistics_.workers_lost = ledger_.lost();
  statistics_.numeric_class = ledger_.numeric_class();
  return statistics_;
}

Session* Server::session_of(WorkerId worker) {
  const auto it = by_worker_.find(worker);
  return it == by_worker_.end() ? nullptr : it->second;
}

void Server::perform(const Actions& actions, const UnitResult* result) {
  for (const Action& action : actions)
    std::visit(Overloaded{
                   [&](const Grant& a) {
                     if (Session* s = session_of(a.worker))
                       s->send(Unit{job_.id, a.lease, units_.at(a.unit)});
                   },
                   [&](const Commit& a) { commit(units_.at(a.unit), *result); },
                   [&](const Acknowledge& a) {
                     // What the merge refused is not committed: the worker keeps it.
                     Session* s = session_of(a.worker);
                     if (s && !pass_error_) s->send(CommitAck{job_.id, a.unit, a.digest});
                   },
                   [&](const Expel& a) { expel(a.worker, a.reason); },
                   [&](const Note& a) { note(a.text); },
                   [&](const FailPass& a) {
                     if (!pass_error_) pass_error_ = a.error;
                   },
               },
               action);
}

void Server::commit(const WorkUnit& unit, const UnitResult& result) {
  if (pass_error_) return;
  if (Status s = on_result_(unit, result); !s) {
    pass_error_ = s.error();
    return;
  }
  ++statistics_.units;
  statistics_.rays += result.rays;
  statistics_.nonfinite += result.nonfinite;
  statistics_.worker_seconds += result.seconds;
  if (result.nonfinite)
    note(text("unit {} dropped {} contributions that were not finite, the first at texel {}, sample {}",
              unit.id, result.nonfinite, result.nonfinite_texel, result.nonfinite_sample));
}

void Server::expel(WorkerId worker, const std::string& reason) {
  Session* session = session_of(worker);
  if (!session) return;
  note(text("{} is refused: {}", session->name(), reason));
  expelled_[worker] = reason;
  session->refuse(reason);
  Actions actions;
  ledger_.leave(worker, false, reason, clock_.now_ms(), actions);
  perform(actions);
}

Expected<WorkerId> Server::admit(const Hello& hello, Session& session) {
  if (!equal_secret(hello.token, settings_.token)) {
    note(text("{} is refused: wrong token", session.name()));
    return fail(
        ErrorKind::kUsage,
        "the token is not this coordinator's: give the worker the coordinator's token with --token-file or "
        "KILN_TOKEN");
  }
  if (hello.threads == 0 || hello.threads > kMaxThreads)
    return fail(ErrorKind::kUsage, text("{} threads is not a possible number", hello.threads));
  const auto known = by_instance_.try_emplace(hello.instance, last_worker_ + 1);
  const WorkerId worker = known.first->second;
  if (known.second) ++last_worker_;
  if (const auto it = expelled_.find(worker); it != expelled_.end())
    return fail(ErrorKind::kUsage, it->second);
  if (Session* older = session_of(worker)) {  // the process gave a connection up that we have not yet
    Actions actions;
    ledger_.leave(worker, false, "it connected anew", clock_.now_ms(), actions);
    by_worker_.erase(worker);
    older->goodbye("you connected anew");
    perform(actions);
  }
  by_worker_[worker] = &session;
  return worker;
}

Welcome Server::welcome(WorkerId worker) const {
  return {worker, std::max(10u, settings_.lease_ms / 4), settings_.lease_ms};
}

void Server::on_heard(Session& session) {
  Actions actions;
  ledger_.heard(session.worker(), clock_.now_ms(), actions);
  perform(actions);
}

void Server::on_ready(Session& session, const std::string& numeric_class, uint32_t credits) {
  Actions actions;
  ledger_.join(session.worker(), session.name(), numeric_class, session.threads(), credits, clock_.now_ms(),
               actions);
  perform(actions);
}

void Server::on_job_failed(Session& session, const JobFailed& failed) {
  if (failed.kind == ErrorKind::kInvalidInput && !pass_error_)
    pass_error_ = Error{failed.kind, failed.reason};
  expel(session.worker(), text("it cannot bake this job: {}", failed.reason));
}

void Server::on_result(Session& session, Result&& result) {
  const WorkerId worker = session.worker();
  if (!ledger_.is_member(worker)) return session.refuse("a result came before Credits");
  const uint64_t id = result.result.unit;
  if (!ledger_.asked_for(id)) return expel(worker, text("it answers unit {}, which nobody asked for", id));
  const auto unit = units_.find(id);
  const auto sites = unit == units_.end() ? 0u : static_cast<uint32_t>(unit->second.sites.size());
  const int64_t now = clock_.now_ms();
  Actions actions;
  if (const Status good = check_result(result, sites, plane_count_); !good) {
    ledger_.unit_failed(worker, result.lease, id, Error{ErrorKind::kInternal, good.error().message}, now,
                        actions);
    actions.push_back(Expel{worker, good.error().message});
    return perform(actions);
  }
  ledger_.result(worker, result.lease, id, result.digest, now, actions);
  perform(actions, &result.result);
}

void Server::on_unit_failed(Session& session, const UnitFailed& failed) {
  Actions actions;
  ledger_.unit_failed(session.worker(), failed.lease, failed.unit, Error{failed.kind, failed.reason},
                      clock_.now_ms(), actions);
  perform(actions);
}

void Server::on_drain(Session& session, const Drain& drain) {
  Actions actions;
  ledger_.drain(session.worker(), drain.units, clock_.now_ms(), actions);
  perform(actions);
}

void Server::on_closed(Session& session, bool orderly, const std::string& reason) {
  const WorkerId worker = session.worker();
  if (session_of(worker) == &session) {
    by_worker_.erase(worker);
    Actions actions;
    ledger_.leave(worker, !orderly, reason, clock_.now_ms(), actions);
    perform(actions);
  } else if (!worker) {
    note(text("{} went before it was admitted: {}", session.name(), reason));
  }
  sessions_.erase(&session);
}

}  // namespace kiln

#include "coordinator/farm/dispatch/server.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/dispatch/result_check.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxCredits = 4 * kMaxWorkerThreads;
constexpr uint64_t kMaxParkedBytes = uint64_t{256} << 20;  // of results whose units do not exist yet
constexpr int64_t kRateWindowMs = 60000;

}  // namespace

Server::Server(Timing& timing, const FarmSettings& settings, ResultStore& store)
    : timing_(timing),
      settings_(settings),
      store_(store),
      ledger_(settings.rules),
      alive_(std::make_shared<Alive>()) {
  alive_->timing = &timing;
}

Server::~Server() {
  const std::lock_guard lock(alive_->mutex);
  alive_->timing = nullptr;
}

void Server::accept(std::unique_ptr<Link> link) {
  KILN_CHECK(link != nullptr);
  auto session = std::make_unique<Session>(timing_, *this, std::move(link));
  Session& started = *session;
  sessions_.push_back(std::move(session));
  started.start();
}

Status Server::listen(EventLoop& loop) {
  ListenOptions options;
  options.tls = settings_.tls;
  options.admit_strangers = settings_.admit_strangers;
  const auto admit = [this](std::unique_ptr<Connection> connection) {
    connection->set_limits({memory_, connection->caller()});
    accept(make_link(std::move(connection)));
  };
  KILN_TRY(listener_, Listener::open(loop, settings_.listen_host, settings_.listen_port, admit, options));
  return {};
}

void Server::tick() {
  KILN_CHECK(std::this_thread::get_id() == thread_ && !performing_);
  cut_off_revoked();
  Actions actions;
  ledger_.tick(timing_.now_ms(), actions);
  perform(std::move(actions));
  for (auto& [id, job] : jobs_) {
    const PassCounts pass = ledger_.pass(id);
    const JobCounts counts = ledger_.counts(id);
    job.port->set_progress({pass.done + pass.failed, pass.units, 0, counts.workers, counts.threads,
                            pass.weight_done, pass.weight});
  }
  if (settings_.others_may_come || members_.size() < settings_.local_workers) return;
  for (auto& [id, job] : jobs_) {
    if (job.port->error() || ledger_.stuck_ms(id, timing_.now_ms()) <= settings_.rules.lease_ms) continue;
    const JobCounts counts = ledger_.counts(id);
    fail_job(
        id,
        Error{ErrorKind::kInternal,
              counts.disputes
                  ? text("{} units were answered by different workers with different bytes and no further "
                         "worker is available to decide: one of them computes wrongly or runs another build",
                         counts.disputes)
                  : std::string("no worker that is here can go on with the job, and no other will come")});
  }
}

void Server::dismiss_all(const std::string& reason) {
  listener_.reset();
  for (const auto& session : sessions_) session->goodbye(reason);
}

Session* Server::session_of(WorkerId worker) const {
  const auto it = members_.find(worker);
  return it == members_.end() ? nullptr : it->second.session;
}

const Bytes* Server::chunk(const Digest& id) const {
  for (const auto& [job_id, job] : jobs_) {
    if (const Bytes* bytes = job.chunks->find(id)) return bytes;
    if (const auto it = job.added.find(id); it != job.added.end()) return it->second.get();
  }
  return nullptr;
}

void Server::on_heard(Session& session) {
  Actions actions;
  ledger_.heard(session.worker(), timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::on_class(Session& session, const JobClass& message) {
  ledger_.prove(session.worker(), message.job, message.numeric_class);
}

void Server::on_ready(Session& session, const std::string& numeric_class, const Credits& credits) {
  Actions actions;
  ledger_.ready(session.worker(), credits.job, numeric_class, std::min(credits.units, kMaxCredits),
                credits.held, timing_.now_ms(), actions);
  perform(std::move(actions));
  const std::string& its_class = ledger_.numeric_class(credits.job);
  if (its_class != numeric_class)
    fail_if_refused_by_all(credits.job,
                           text("numeric class {} differs from the job's {}", numeric_class, its_class));
}

// On one machine no other worker will connect.
void Server::fail_if_refused_by_all(JobId job, const std::string& reason) {
  if (settings_.others_may_come || !find_job(job)) return;
  const bool all = std::all_of(members_.begin(), members_.end(),
                               [&](const auto& member) { return ledger_.is_banned(member.first, job); });
  if (all) fail_job(job, Error{ErrorKind::kUnavailable, text("no worker can bake this job: {}", reason)});
}

void Server::on_job_failed(Session& session, const JobFailed& failed) {
  Actions actions;
  ledger_.job_refused(session.worker(), failed.job, Error{failed.kind, failed.reason}, timing_.now_ms(),
                      actions);
  perform(std::move(actions));
  fail_if_refused_by_all(failed.job, failed.reason);
}

void Server::on_result(Session& session, Result&& result) {
  const WorkerId worker = session.worker();
  OpenJob* job = find_job(result.job);
  if (!job) return session.send(JobEnded{result.job, "it is not baked here any more"});
  if (!ledger_.knows(result.job, result.result.unit)) {
    // A restarted coordinator has not created its units yet: the result waits for them.
    const uint64_t bytes = result.result.moments.size() * sizeof(double) + sizeof(Result);
    // A resumed job replays its passes: the result may belong to a later one.
    if (job->units && !job->resumed)
      return expel(worker, text("it answers unit {}, which it was not given", result.result.unit));
    if (parked_bytes_ + bytes > kMaxParkedBytes)
      return;  // the worker keeps it and delivers it after reconnecting
    parked_bytes_ += bytes;
    job->parked.emplace_back(worker, std::move(result));
    return;
  }
  take_result(worker, *job, std::move(result));
}

void Server::take_result(WorkerId worker, OpenJob& job, Result&& result) {
  const auto member = members_.find(worker);
  if (member == members_.end()) return;
  const JobId job_id = result.job;
  const uint64_t unit = result.result.unit;
  const WorkUnit* known = job.units ? job.units->find(unit) : nullptr;
  const int64_t now = timing_.now_ms();
  Actions actions;
  if (known && result.shape && result.shape != unit_shape(*known)) {
    note(job_id, text("{} answered a version of unit {} from before the job started over: it is ignored",
                      member->second.session->name(), unit));
    member->second.session->send(CommitAck{job_id, unit, result.digest});
    ledger_.hand_back(worker, job_id, unit, now, actions);
    return perform(std::move(actions));
  }
  if (const Status good = check_result(result, known, job.layout); !good) {
    const std::string reason = good.error().message;
    ledger_.unit_failed(worker, job_id, unit, Error{ErrorKind::kInternal, reason}, now, actions);
    ledger_.quarantine(member->second.identity, reason, now, actions);
    return perform(std::move(actions));
  }
  ++results_;
  Member& m = member->second;
  ++m.units;
  m.rays += result.result.rays;
  rays_ += result.result.rays;
  m.recent.emplace_back(now, result.result.rays);
  while (now - m.recent.front().first > kRateWindowMs) m.recent.pop_front();
  job.rays += result.result.rays;
  const AnswerKey key{job_id, unit, result.digest};
  const auto shared = std::make_shared<const UnitResult>(std::move(result.result));
  const bool added = arrived_.emplace(key, shared).second;
  ledger_.result(worker, job_id, unit, result.digest, now, actions);
  KILN_CHECK(shared->unit == unit);
  const bool wanted = std::any_of(actions.begin(), actions.end(), [&](const Action& a) {
    const auto* s = std::get_if<StoreAnswer>(&a);
    return s && s->job == job_id && s->unit == unit && s->digest == result.digest;
  });
  perform(std::move(actions));
  if (added && !wanted) arrived_.erase(key);
}

void Server::on_unit_failed(Session& session, const UnitFailed& failed) {
  if (const auto member = members_.find(session.worker()); member != members_.end()) ++member->second.failed;
  Actions actions;
  ledger_.unit_failed(session.worker(), failed.job, failed.unit, Error{failed.kind, failed.reason},
                      timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::on_drain(Session& session, const Drain& drain) {
  Actions actions;
  ledger_.drain(session.worker(), drain.units, timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::on_closed(Session& session, bool orderly, const std::string& reason) {
  const WorkerId worker = session.worker();
  if (session_of(worker) == &session) {
    members_.erase(worker);
    Actions actions;
    ledger_.leave(worker, !orderly, reason, timing_.now_ms(), actions);
    perform(std::move(actions));
  } else if (!worker && !orderly) {
    note(0, text("{} went: {}", session.name(), reason));
  }
  const auto it = std::find_if(sessions_.begin(), sessions_.end(),
                               [&](const auto& other) { return other.get() == &session; });
  KILN_CHECK(it != sessions_.end());
  sessions_.erase(it);
}

}  // namespace kiln

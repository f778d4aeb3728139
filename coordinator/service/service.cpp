#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/client_session.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/turn.h"
#include "coordinator/service/unix_time.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr size_t kRequestThreads = 4;

// An older release left the folder open to others; it holds scenes, results and tokens.
void keep_private(const fs::path& data) {
  std::error_code code;
  const fs::perms mode = fs::status(data, code).permissions();
  if (code || (mode & (fs::perms::group_all | fs::perms::others_all)) == fs::perms::none) return;
  fs::permissions(data, fs::perms::owner_all, code);
  if (code)
    log_warning(
        text("others may look into {}, and its mode cannot be changed: {}; let its owner chmod 700 it",
             data.string(), code.message()));
}

}  // namespace

Status ServiceImpl::open() {
  StoreOptions options = settings_.store;
  options.release = settings_.release;
  KILN_TRY(store_, Store::open(settings_.data, options));
  keep_private(settings_.data);
  KILN_TRY(blobs_, BlobStore::open(settings_.data / "blobs", {}));
  KILN_TRY(tokens_, service_tokens(settings_.data));
  if (settings_.authority.empty()) settings_.authority = settings_.data / "authority";
  audit_ = std::make_unique<AuditLog>(fs::absolute(settings_.data) / "audit.jsonl");
  events_ = std::make_unique<EventLog>(store_->epoch());
  pool_ = std::make_unique<TaskPool>(kRequestThreads);
  start_clock();
  KILN_TRY_STATUS(open_farm());
  // On a disk that is full the service lists and sends what it has, and goes on by itself when there is
  // space.
  if (const Status writes = store_->probe(); !writes) {
    log_warning(text("nothing is taken or handed out: {}", writes.error().message));
    results_->hold(writes.error().message);
  }
  if (const Status taken = take_up_jobs(); !taken && taken.error().kind != ErrorKind::kNoSpace) return taken;
  collect();
  keeper_ = std::thread([this] { keep(); });
  if (settings_.scrub_mib_s) scrubber_ = std::thread([this] { scrub(); });
  open_ = true;
  return {};
}

// Jobs that were active when the last coordinator ended return to the queue and keep their results. On a full
// disk the keeper tries again.
Status ServiceImpl::take_up_jobs() {
  if (taken_up_ || !held_for().empty()) return {};
  std::error_code ignored;
  fs::remove_all(settings_.data / "work", ignored);
  for (const JobRecord& job : store_->jobs()) {
    if (!is_active(job.state)) continue;
    KILN_TRY_STATUS(store_->change(job.id, [](JobRecord& j) -> Status {
      j.state = JobState::kQueued;
      j.reason = "the coordinator was started again";
      return {};
    }));
    if (const int64_t pause = finishing_pause_ms(job)) not_before_[job.id] = steady_ms() + pause;
    note(job.id, "the coordinator was started again: the job goes on with the results it has");
  }
  taken_up_ = true;
  return {};
}

Status ServiceImpl::open_farm() {
  results_ = std::make_shared<DurableResultStore>(
      *store_, DurableResultStore::Hooks{[this](const std::string& reason) {
                                           {
                                             const std::lock_guard lock(mutex_);
                                             held_for_ = reason;
                                           }
                                           if (open_) farm_->hold(!reason.empty(), reason);
                                         },
                                         [this](JobId job, const std::string& text) { note(job, text); }});
  FarmSettings farm = settings_.farm;
  if (farm.token.empty() && !farm.tls) {
    farm.token = tokens_.worker.shared;
    farm.owner_tokens = tokens_.worker.owners;
  }
  farm.others_may_come = farm.comes_back = true;
  farm.clients.admit = [this](const ClientHello& hello, const PeerIdentity& identity,
                              ClientLink& link) -> Expected<std::unique_ptr<ClientTalk>> {
    if (!open_ || stopping_)
      return fail(ErrorKind::kUnavailable, "the coordinator is starting or stopping: try again");
    KILN_TRY(Caller caller, recognise(hello, identity, settings_.farm.tls != nullptr, tokens_));
    caller.peer = link.peer();
    return std::unique_ptr<ClientTalk>(std::make_unique<ClientSession>(*this, caller, link));
  };
  farm.on_revoked = [this](const PeerIdentity& whose, const std::string& peer) {
    pool_->give([this, line = revocation_line(unix_ms(), whose, peer)] { write_audit(line); });
  };
  KILN_TRY(farm_, Farm::start(farm, results_));
  for (const WorkerRecord& worker : store_->workers())
    farm_->restore_trust(worker.identity, worker.good_verifications,
                         worker.quarantined ? worker.quarantine_reason : "");
  return {};
}

bool ServiceImpl::stop(std::chrono::milliseconds patience) {
  if (stopped_) return true;
  stopping_ = true;
  wake();
  if (keeper_.joinable()) keeper_.join();  // no job is started from here on
  if (scrubber_.joinable()) scrubber_.join();
  if (backup_.joinable()) backup_.join();
  if (pool_) pool_->stop();
  {
    std::unique_lock lock(mutex_);
    for (auto& [id, active] : active_) active->stop = true;
    std::vector<JobId> ids;
    for (auto& [id, active] : active_) ids.push_back(id);
    lock.unlock();
    for (const JobId id : ids)
      farm_->stop_job(id, Error{ErrorKind::kUnavailable, "the coordinator was told to stop"});
    lock.lock();
    const bool all = changed_.wait_for(lock, patience, [this] {
      return std::all_of(active_.begin(), active_.end(),
                         [](const auto& a) { return a.second->ended.load(); });
    });
    if (!all) {
      lock.unlock();
      results_->drain(std::chrono::seconds(5));
      store_->flush();
      return false;
    }
  }
  for (auto& [id, active] : active_)
    if (active->thread.joinable()) active->thread.join();
  active_.clear();
  // The writer may be calling the farm, so it ends first. The farm keeps the object until its own end.
  if (results_) {
    results_->drain(std::chrono::seconds(5));
    results_->stop();
  }
  open_ = false;
  farm_.reset();
  if (store_) store_->close();
  stopped_ = true;
  return true;
}

std::string ServiceImpl::held_for() const {
  const std::lock_guard lock(mutex_);
  return held_for_;
}

void ServiceImpl::note(JobId job, const std::string& what) {
  const int64_t now = now_ms();
  events_->add(now, job, what);
  if (job) store_->event(job, now, what);
}

void ServiceImpl::audit(const Caller& caller, const std::string& verb, const JsonValue& document,
                        const std::string& reply) {
  // A submission that misses files changes nothing yet.
  if (verb == "submit" && reply.find("\"id\"") == reply.npos) return;
  write_audit(audit_line(unix_ms(), caller, verb, document, reply));
}

void ServiceImpl::write_audit(const std::string& line) {
  if (const Status s = audit_->append(line); !s)
    log_error(text("a change is not in the audit log: {}; it was {}", s.error().message,
                   std::string_view(line).substr(0, line.size() - 1)));
}

void ServiceImpl::wake() {
  {
    const std::lock_guard lock(mutex_);
    look_ = true;
  }
  changed_.notify_all();
}

std::optional<BakeProgress> ServiceImpl::progress_of(JobId job) const {
  const std::lock_guard lock(mutex_);
  const auto it = active_.find(job);
  if (it == active_.end() || it->second->ended) return std::nullopt;
  return it->second->progress;
}

bool ServiceImpl::is_running(JobId job) const {
  const std::lock_guard lock(mutex_);
  const auto it = active_.find(job);
  return it != active_.end() && !it->second->ended;
}

Status ServiceImpl::cancel(JobId id, const std::string& who) {
  const std::string reason = text("cancelled by {}", who);
  bool running = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = active_.find(id); it != active_.end() && !it->second->ended) {
      it->second->who = who;
      it->second->cancelled = it->second->stop = true;
      running = true;
    }
  }
  if (running) {
    farm_->stop_job(id, Error{ErrorKind::kUnavailable, reason});
    return {};
  }
  KILN_TRY_STATUS(store_->change(id, [&](JobRecord& job) -> Status {
    if (job_ended(job.state))
      return fail(ErrorKind::kUsage,
                  text("job {} is {}: nothing is left to cancel", id, job_state_name(job.state)));
    if (is_active(job.state))
      return fail(ErrorKind::kUnavailable, text("job {} is just beginning: ask again", id));
    job.state = JobState::kCancelled;
    job.reason = reason;
    job.ended_ms = now_ms();
    return {};
  }));
  store_->drop_results(id, {});
  note(id, reason);
  wake();
  return {};
}

Status ServiceImpl::set_paused(JobId id, bool paused) {
  JobRecord changed;
  KILN_TRY_STATUS(store_->change(id, [&](JobRecord& job) -> Status {
    if (job_ended(job.state))
      return fail(ErrorKind::kUsage, text("job {} is {} and cannot be {}", id, job_state_name(job.state),
                                          paused ? "paused" : "resumed"));
    if (is_kept(job) && !paused) {  // to resume it is to try it again
      job.preparations = kFinishings;
      job.reason.clear();
    }
    job.paused = paused;
    changed = job;
    return {};
  }));
  farm_->change_job(id, changed.priority, paused);
  note(id, paused ? "paused" : "resumed");
  wake();
  return {};
}

Status ServiceImpl::set_priority(JobId id, int32_t priority) {
  JobRecord changed;
  KILN_TRY_STATUS(store_->change(id, [&](JobRecord& job) -> Status {
    if (job_ended(job.state))
      return fail(ErrorKind::kUsage,
                  text("job {} is {}: a priority would change nothing", id, job_state_name(job.state)));
    job.priority = priority;
    changed = job;
    return {};
  }));
  farm_->change_job(id, priority, changed.paused);
  note(id, text("priority {}", priority));
  wake();
  return {};
}

Status ServiceImpl::retry(JobId id) {
  std::string why;
  KILN_TRY_STATUS(store_->change(id, [&](JobRecord& job) -> Status {
    const bool kept = is_kept(job);
    const bool doubtful = job.state == JobState::kDone && job.tainted;
    if (job.state != JobState::kFailed && job.state != JobState::kCancelled && !kept && !doubtful)
      return fail(ErrorKind::kUsage,
                  text("job {} is {}: only failed, cancelled and tainted jobs are tried again", id,
                       job_state_name(job.state)));
    const bool only_finishes = kept || (has_finished_baking(job) && job.state == JobState::kFailed);
    why = job.taint.empty() ? "" : text(": its result was tainted: {}", job.taint);
    job.tainted = false;
    job.taint.clear();
    job.verification.clear();
    job.preparations = only_finishes ? kFinishings : 0;
    job.state = job.after.empty() || kept ? JobState::kQueued : JobState::kWaiting;
    job.reason.clear();
    if (kept) job.paused = false;
    job.ended_ms = 0;
    return {};
  }));
  note(id, "tried again" + why);
  wake();
  return {};
}

Status ServiceImpl::forgive(const std::string& identity) {
  KILN_TRY_STATUS(store_->forgive(identity));
  farm_->restore_trust(identity, 0, "");
  note(0, text("worker {} is forgiven", identity));
  return {};
}

Expected<std::unique_ptr<Service>> Service::start(const ServiceSettings& settings) {
  auto service = std::make_unique<ServiceImpl>(settings);
  KILN_TRY_STATUS(service->open());
  return std::unique_ptr<Service>(std::move(service));
}

}  // namespace kiln

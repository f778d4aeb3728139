// Jobs, their passes and their status.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "common/responses/basis.h"
#include "coordinator/farm/dispatch/server.h"

namespace kiln {
namespace {

constexpr size_t kMaxEvents = 2000;  // events kept per job, for the report

}  // namespace

Server::OpenJob* Server::find_job(JobId job) {
  const auto it = jobs_.find(job);
  return it == jobs_.end() ? nullptr : &it->second;
}

void Server::note(JobId job, const std::string& what) {
  log_info(job ? text("job {}: {}", job, what) : what);
  for (auto& [id, open] : jobs_) {
    if (job != 0 && id != job) continue;
    if (open.events.size() >= kMaxEvents) open.events.pop_front();
    open.events.push_back(what);
  }
  if (job) store_.note(job, what);
}

Status Server::open_job(const FarmJobSpec& spec, std::shared_ptr<JobPort> port) {
  if (jobs_.count(spec.spec.id))
    return fail(ErrorKind::kInternal, text("job {} is open already", spec.spec.id));
  OpenJob& job = jobs_[spec.spec.id];
  KILN_CHECK(spec.spec.id != 0 && spec.chunks && port);
  job.spec = spec.spec;
  job.chunks = spec.chunks;
  job.port = std::move(port);
  job.layout = MomentLayout(spec.spec.transport.basis, spec.spec.transport.quantities);
  ledger_.add_job(spec.spec.id, spec.traits);
  // A process that comes back says where it is; until then nobody knows whose vote its answer was.
  std::vector<KnownAnswer> known = spec.known;
  for (KnownAnswer& answer : known)
    answer.own_voter = settings_.tls || settings_.owner_tokens.count(answer.identity);
  ledger_.restore(spec.spec.id, known);
  job.resumed = !spec.known.empty();
  return {};
}

void Server::close_job(JobId id) {
  if (!find_job(id)) return;
  ended_duplicates_ += ledger_.counts(id).duplicates;
  Actions actions;
  ledger_.end_job(id, "the job has ended", timing_.now_ms(), actions);
  perform(std::move(actions));
  std::erase_if(arrived_, [&](const auto& entry) { return std::get<0>(entry.first) == id; });
  for (const auto& [worker, result] : jobs_.at(id).parked) {
    const uint64_t bytes = result.result.moments.size() * sizeof(double) + sizeof(Result);
    KILN_CHECK(parked_bytes_ >= bytes);
    parked_bytes_ -= bytes;
  }
  jobs_.erase(id);
  store_.end_job(id);
}

void Server::change_job(JobId id, int32_t priority, bool paused) {
  Actions actions;
  ledger_.change_job(id, priority, paused, timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::add_chunk(JobId id, const Digest& chunk, std::shared_ptr<const Bytes> bytes) {
  KILN_CHECK(bytes != nullptr);
  if (OpenJob* job = find_job(id)) job->added.emplace(chunk, std::move(bytes));
}

void Server::keep_chunks(JobId id, const std::set<Digest>& chunks) {
  if (OpenJob* job = find_job(id))
    std::erase_if(job->added, [&](const auto& entry) { return !chunks.count(entry.first); });
}

void Server::begin_pass(JobId id, std::shared_ptr<const PassUnits> units) {
  OpenJob* job = find_job(id);
  if (!job || job->port->error()) return;
  KILN_CHECK(units != nullptr);
  job->units = std::move(units);
  std::vector<UnitPlan> plan;
  plan.reserve(job->units->units.size());
  for (const WorkUnit& unit : job->units->units)
    plan.push_back({unit.id, unit_shape(unit),
                    static_cast<double>(unit.sites.size()) * static_cast<double>(unit.sample_count)});
  Actions actions;
  ledger_.begin_pass(id, plan, timing_.now_ms(), actions);
  perform(std::move(actions));
  std::vector<std::pair<WorkerId, Result>> parked = std::move(job->parked);
  job->parked.clear();
  for (auto& [worker, result] : parked) {
    if (!ledger_.knows(id, result.result.unit)) {  // of a later pass
      job->parked.emplace_back(worker, std::move(result));
      continue;
    }
    const uint64_t bytes = result.result.moments.size() * sizeof(double) + sizeof(Result);
    KILN_CHECK(parked_bytes_ >= bytes);
    parked_bytes_ -= bytes;
    take_result(worker, *job, std::move(result));
  }
}

void Server::end_pass(JobId id) {
  Actions actions;
  ledger_.abandon_pass(id, timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::fail_job(JobId id, const Error& error) {
  OpenJob* job = find_job(id);
  if (!job) return;
  note(id, error.message);
  job->port->fail_with(error);
  end_pass(id);
}

void Server::fail_all(const Error& error) {
  for (auto& [id, job] : jobs_)
    if (!job.port->error()) fail_job(id, error);
}

void Server::damaged(JobId id, uint64_t unit, const std::string& why) {
  note(id, text("the stored result of unit {} cannot be used and is baked again: {}", unit, why));
  Actions actions;
  ledger_.damaged(id, unit, timing_.now_ms(), actions);
  perform(std::move(actions));
}

void Server::hold(bool on, const std::string& reason) {
  if (on && held_for_ != reason) note(0, text("nothing is handed out: {}", reason));
  if (!on && !held_for_.empty()) note(0, "the store writes again: work goes on");
  held_for_ = on ? reason : "";
  Actions actions;
  ledger_.hold(on, timing_.now_ms(), actions);
  perform(std::move(actions));
}

FarmStatistics Server::statistics(JobId id) {
  FarmStatistics s;
  const OpenJob* job = find_job(id);
  if (!job) return s;
  const JobCounts counts = ledger_.counts(id);
  s.duplicates = counts.duplicates;
  s.reassigned = counts.reassigned;
  s.copies = counts.copies;
  s.workers_lost = counts.lost;
  s.verification = ledger_.verification(id);
  s.numeric_class = ledger_.numeric_class(id);
  s.events.assign(job->events.begin(), job->events.end());
  return s;
}

FarmStatus Server::status() const {
  FarmStatus status;
  const int64_t now = timing_.now_ms();
  for (const auto& [id, member] : members_) {
    const WorkerView view = ledger_.view(id, now);
    WorkerStatus w;
    w.id = id;
    w.name = member.session->name();
    w.identity = member.identity;
    w.owner = member.owner;
    w.peer = member.session->peer();
    w.release = member.session->hello().version;
    w.threads = member.session->hello().threads;
    w.job = view.job;
    w.state = view.state;
    w.units_held = view.held;
    w.credits = view.credits;
    w.agreed = view.agreed;
    w.units_done = member.units;
    w.units_failed = member.failed;
    w.rays = member.rays;
    w.queued_bytes = member.session->queued_bytes();
    uint64_t rays = 0;
    for (const auto& [when, count] : member.recent)
      if (now - when <= 60000) rays += count;
    if (!member.recent.empty())
      w.rays_per_second = static_cast<double>(rays) * 1000 /
                          static_cast<double>(std::max<int64_t>(1000, now - member.recent.front().first));
    status.workers.push_back(std::move(w));
  }
  for (const auto& [id, job] : jobs_) {
    const PassCounts pass = ledger_.pass(id);
    const JobCounts counts = ledger_.counts(id);
    FarmJobStatus j;
    j.job = id;
    j.user = ledger_.user(id);
    j.pass = pass.number;
    j.workers = counts.workers;
    j.threads = counts.threads;
    j.units_done = pass.done;
    j.units_total = pass.units;
    j.units_failed = pass.failed;
    j.weight_done = pass.weight_done;
    j.weight = pass.weight;
    j.rays = job.rays;
    j.verified = counts.verified;
    j.unverified = counts.unverified;
    j.waived = counts.waived;
    j.disputes = counts.disputes;
    status.jobs.push_back(std::move(j));
    status.duplicates += counts.duplicates;
  }
  status.connections = sessions_.size();
  status.clients = static_cast<uint64_t>(
      std::count_if(sessions_.begin(), sessions_.end(), [](const auto& s) { return s->is_client(); }));
  status.results = results_;
  status.rays = rays_;
  status.duplicates += ended_duplicates_;
  status.refused_connections = refused_;
  status.expelled = expelled_count_;
  status.owners_known = settings_.rules.owners_known;
  status.held_for = held_for_;
  return status;
}

std::vector<std::string> Server::why_worker(const std::string& number_or_name) const {
  std::vector<std::string> lines;
  for (const auto& [id, member] : members_) {
    const bool meant = number_or_name == std::to_string(id) || member.identity == number_or_name ||
                       (!settings_.tls && member.session->hello().host == number_or_name);
    if (!meant) continue;
    for (std::string& line : ledger_.why_worker(id, timing_.now_ms())) lines.push_back(std::move(line));
  }
  if (const std::string* why = ledger_.quarantined_for(number_or_name))
    lines.push_back(text("{} is quarantined and not admitted: {}", number_or_name, *why));
  if (lines.empty()) lines.push_back(text("no worker {} is connected", number_or_name));
  return lines;
}

}  // namespace kiln

#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/limits.h"
#include "worker/agent/agent_impl.h"
#include "worker/agent/replay.h"

namespace kiln {
namespace {

uint64_t bytes_of_result(const Result& result) {
  return sizeof result + result.result.moments.size() * sizeof(double);
}

}  // namespace

void Agent::offer() {
  if (draining_ || current()->class_told != connection_count_) return;
  grant(*current());
  deliver_again(*current_);
}

void Agent::tell_class(KnownJob& job) {
  if (welcomed_) job.class_told = connection_count_;
  send(JobClass{job.spec.id, job.numeric_class});
}

// Credits before the class break the protocol: after a reconnect they wait until the job is named again.
void Agent::grant(const KnownJob& job) {
  if (job.class_told != connection_count_) return;
  Credits credits{job.spec.id, full_ ? 0 : settings_.threads + kPrefetchUnits};
  for (const auto& [key, taken] : taken_)
    if (key.first == job.spec.id && !taken.withdrawn) credits.held.push_back(key.second);
  send(credits);
}

void Agent::take_unit(Unit& unit) {
  KnownJob* job = known(unit.job);
  if (!job || !job->baker) return break_connection("a unit of a job that is not ready");
  const UnitKey key{unit.job, unit.unit.id};
  const uint64_t shape = unit_shape(unit.unit);
  if (const auto it = job->kept.find(key.second); it != job->kept.end() && it->second.shape != shape)
    drop_kept(*job, key.second);  // from before a rewind: the number now means other work
  if (const auto it = job->kept.find(key.second); it != job->kept.end()) {
    it->second.lease = unit.lease;  // already baked, and the acknowledgement was lost
    outbox_.push_back(key);
    return pump();
  }
  const auto old = taken_.find(key);
  if (old != taken_.end() && unit_shape(old->second.unit) != shape)
    drop_taken(key.first, [&](uint64_t id) { return id == key.second; });
  if (const auto it = taken_.find(key); it != taken_.end()) {
    it->second = {unit.lease, false, std::move(unit.unit)};  // running units, or those started when these end
    return;
  }
  if (draining_) return send(Drain{{key.second}, "draining"});
  taken_.emplace(key, TakenUnit{unit.lease, false, unit.unit});
  if (unit.unit.cache == Digest{}) return begin(*job, std::move(unit), nullptr);
  waiting_.push_back(std::move(unit));
  feed_waiting();
}

void Agent::begin(const KnownJob& job, Unit unit, std::shared_ptr<const SharedCache> cache) {
  BakeTask task{{}, job.baker, std::move(cache), {}, {}};
  if (environment_.has_disk()) {
    task.replay_file = environment_.replay_file(unit.job, unit.unit.id);
    task.replay = write_replay({job.spec, unit.unit}, {});
  }
  task.unit = std::move(unit);
  environment_.bake(std::move(task), [this](const Unit& baked, Expected<UnitResult> result) {
    on_done(baked, std::move(result));
  });
}

void Agent::on_done(const Unit& unit, Expected<UnitResult> result) {
  const auto it = taken_.find({unit.job, unit.unit.id});
  const TakenUnit taken = std::move(it->second);
  const UnitKey key = it->first;
  taken_.erase(it);
  KnownJob* job = known(unit.job);
  if (job && !taken.withdrawn) {
    if (unit_shape(unit.unit) != unit_shape(taken.unit)) {  // the number now belongs to other work
      Unit next{key.first, taken.lease, taken.unit};
      if (welcomed_) take_unit(next);  // else it is sent again
    } else if (result)
      keep(*job, taken, std::move(*result));
    else
      report_failure(key, taken, result.error());
  }
  fetch();  // may have been waiting for the memory of this unit's job
  leave_if_drained();
}

void Agent::report_failure(const UnitKey& key, const TakenUnit& taken, const Error& error) {
  const std::string replay = keep_replay(key, taken.unit);
  log_error(text("unit {} of job {}: {}{}", key.second, key.first, error.message,
                 replay.empty() ? "" : "\n  to run it alone: " + replay));
  send(UnitFailed{key.first, key.second, taken.lease, error.kind, error.message});
}

std::string Agent::keep_replay(const UnitKey& key, const WorkUnit& unit) {
  const KnownJob* job = known(key.first);
  if (!environment_.has_disk() || !job) return "";
  const std::string file = environment_.replay_file(key.first, key.second);
  std::unordered_set<Digest> chunks = job->chunks;
  if (unit.cache != Digest{}) chunks.insert(unit.cache);
  if (const Status s = environment_.keep_replay(file, write_replay({job->spec, unit}, chunks)); !s) {
    log_warning(s.error().message);
    return "";
  }
  return text("kiln-worker --replay {}", file);
}

void Agent::keep(KnownJob& job, const TakenUnit& taken, UnitResult result) {
  const Digest digest = result_digest(result);
  const uint64_t unit = result.unit;
  drop_kept(job, unit);
  const Result& kept =
      job.kept
          .emplace(unit, Result{job.spec.id, taken.lease, std::move(result), digest, unit_shape(taken.unit)})
          .first->second;
  kept_bytes_ += bytes_of_result(kept);
  outbox_.push_back({job.spec.id, unit});
  pump();
  settle_credits();
}

// After a reconnect, sends the class first: a restarted coordinator does not know it.
void Agent::deliver_again(uint64_t id) {
  KnownJob* job = known(id);
  if (!undelivered_.erase(id) || !job || job->kept.empty()) return;
  if (job->class_told != connection_count_) tell_class(*job);
  for (const auto& [unit, result] : job->kept) outbox_.push_back({id, unit});
  pump();
}

// Keeps the connection's queue short: the kept results may exceed its limit.
void Agent::pump() {
  while (welcomed_ && !outbox_.empty() && connection_->queued_bytes() < kChunkWriteBudget) {
    const auto [id, unit] = outbox_.front();
    outbox_.pop_front();
    const KnownJob* job = known(id);
    if (!job || undelivered_.count(id)) continue;  // sent with the others
    const auto it = job->kept.find(unit);
    if (it == job->kept.end()) continue;
    send(it->second);
  }
}

void Agent::on_ack(const CommitAck& ack) {
  KnownJob* job = known(ack.job);
  if (!job) return;
  const auto it = job->kept.find(ack.unit);
  if (it == job->kept.end() || it->second.digest != ack.digest) return;
  drop_kept(*job, ack.unit);
  settle_credits();
  leave_if_drained();
}

void Agent::drop_kept(KnownJob& job, uint64_t unit) {
  const auto it = job.kept.find(unit);
  if (it == job.kept.end()) return;
  kept_bytes_ -= bytes_of_result(it->second);
  job.kept.erase(it);
}

void Agent::withdraw(const Withdraw& withdraw) {
  KnownJob* job = known(withdraw.job);
  if (!job) return;
  const std::set<uint64_t> units(withdraw.units.begin(), withdraw.units.end());
  drop_taken(withdraw.job, [&](uint64_t unit) { return units.count(unit) > 0; });
  for (const uint64_t unit : units) drop_kept(*job, unit);
  settle_credits();
  leave_if_drained();
}

std::vector<Unit> Agent::take_unbegun(const std::function<bool(const Unit&)>& wanted) {
  std::vector<Unit> units = environment_.take_unbegun(wanted);
  std::copy_if(waiting_.begin(), waiting_.end(), std::back_inserter(units), wanted);
  stop_waiting(wanted);
  return units;
}

// A running unit cannot be interrupted: its result is dropped when it arrives.
void Agent::drop_taken(uint64_t job, const std::function<bool(uint64_t unit)>& wanted) {
  for (const Unit& unit : take_unbegun([&](const Unit& u) { return u.job == job && wanted(u.unit.id); }))
    taken_.erase({job, unit.unit.id});
  for (auto& [key, taken] : taken_)
    if (key.first == job && wanted(key.second)) taken.withdrawn = true;
}

void Agent::settle_credits() {
  const bool full = kept_bytes_ > (full_ ? settings_.kept_bytes / 2 : settings_.kept_bytes);
  if (full == full_) return;
  full_ = full;
  const KnownJob* job = current();
  if (job && job->baker && !job->numeric_class.empty() && !draining_) grant(*job);
}

// Ends the process, because the thread cannot be stopped; the supervisor restarts it.
void Agent::stop_if_stuck() {
  const auto oldest = environment_.oldest();
  if (!oldest || leaving_ || timing_.now_ms() - oldest->at_ms < settings_.unit_limit_ms) return;
  const UnitKey key{oldest->job, oldest->unit};
  const auto it = taken_.find(key);
  if (it == taken_.end()) return;  // just finished
  std::string reason = text(
      "unit {} of job {} has run for more than {} s: this worker ends, because a unit cannot "
      "be interrupted (--unit-limit)",
      key.second, key.first, settings_.unit_limit_ms / 1000);
  if (const std::string replay = keep_replay(key, it->second.unit); !replay.empty())
    reason += "\n  to run it alone: " + replay;
  if (!it->second.withdrawn)
    send(UnitFailed{key.first, key.second, it->second.lease, ErrorKind::kInternal, reason});
  leaving_ = fail(ErrorKind::kInternal, reason);
  if (!connection_) return finish(*leaving_);
  welcomed_ = false;
  connection_->close_after_writes("a unit hangs");
}

}  // namespace kiln

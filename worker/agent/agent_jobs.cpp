#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/scene/prepared.h"
#include "common/wire/limits.h"
#include "worker/agent/agent_impl.h"

namespace kiln {
namespace {

constexpr uint64_t kCacheBytes = uint64_t{4} << 30;  // chunks of earlier jobs are kept up to this

}  // namespace

void Agent::start_job(const Job& message) {
  auto job = read_job(message.spec);
  if (!job) return break_connection(job.error().message);
  const bool same = job_ && write_job(*job_) == message.spec;
  if (same) {  // after a reconnect: go on where we were
    waiting_job_.reset();
    if (!class_.empty()) send(JobClass{job_->id, class_});
    return pool_ ? offer() : fetch();
  }
  if (!idle()) {  // a unit cannot be interrupted; those not begun nobody wants any more
    if (pool_) running_ -= pool_->take_unbegun().size();
    waiting_job_ = message;
    if (!idle()) return;
  }
  waiting_job_.reset();
  pool_.reset();
  kept_.clear();
  class_.clear();
  job_ = std::move(*job);
  fetch_.emplace(*job_, cache_);
  // The class and the chunks do not wait for each other.
  classifier_ = std::jthread([this, id = job_->id, isa = job_->transport.isa] {
    auto name = settings_.numeric_class(isa);
    loop_.post([this, id, name = std::move(name)] { on_class(id, name); });
  });
  fetch();
}

void Agent::start_waiting_job() {
  if (!waiting_job_ || !idle()) return;
  const Job job = std::move(*waiting_job_);
  waiting_job_.reset();
  start_job(job);
}

void Agent::on_class(uint64_t job, Expected<std::string> name) {
  if (!job_ || job_->id != job) return;
  if (!name) return fail_job(name.error());
  class_ = *name;
  send(JobClass{job, class_});
  if (pool_) offer();
}

void Agent::fail_job(const Error& error) {
  log_error(text("cannot bake this job: {}", error.message));
  send(JobFailed{job_->id, error.kind, error.message});
}

void Agent::fetch() {
  if (!fetch_ || preparing_ || pool_) return;
  const auto ids = fetch_->next();
  if (!ids) return fail_job(ids.error());
  if (!ids->empty()) {
    // On loopback the network is faster than zstd.
    send(ChunkRequest{*ids, !connection_->loopback()});
  } else if (fetch_->complete()) {
    prepare();
  }
}

void Agent::on_piece(const ChunkPiece& piece) {
  if (!fetch_ || !fetch_->expects(piece.id)) return break_connection("a chunk that was not asked for");
  const auto complete = cache_.add(piece);
  if (!complete) return break_connection(complete.error().message);
  if (!*complete) return;
  fetch_->arrived(piece.id);
  fetch();
}

void Agent::prepare() {
  cache_.shrink(fetch_->needed(), kCacheBytes);
  preparing_ = true;
  log_info(text("making the scene ready: {} MiB of chunks", cache_.total_bytes() >> 20));
  // The loop does not touch the cache until on_prepared: no chunk is expected meanwhile.
  preparer_ = std::jthread([this, job = *job_] {
    auto make = [&]() -> Expected<std::shared_ptr<const Baker>> {
      KILN_TRY(Scene scene,
               read_scene(*cache_.find(job.scene), [&](const Digest& id) { return cache_.find(id); }));
      KILN_TRY(Atlas atlas, read_atlas(*cache_.find(job.atlas), scene));
      KILN_TRY(auto baker,
               settings_.make_baker(std::move(scene), std::move(atlas), job.transport, settings_.threads));
      return std::shared_ptr<const Baker>(std::move(baker));
    };
    Expected<std::shared_ptr<const Baker>> baker = fail(ErrorKind::kInternal, "the scene was not made");
    try {
      baker = make();
    } catch (const std::bad_alloc&) {
      baker = fail(ErrorKind::kNoSpace, "not enough memory for the scene on this machine");
    } catch (const std::exception& e) {
      baker = fail(ErrorKind::kInternal, e.what());
    }
    loop_.post([this, id = job.id, baker = std::move(baker)] { on_prepared(id, baker); });
  });
}

void Agent::on_prepared(uint64_t job, Expected<std::shared_ptr<const Baker>> baker) {
  preparing_ = false;
  if (waiting_job_) return start_waiting_job();
  if (!job_ || job_->id != job) return;
  if (!baker) return fail_job(baker.error());
  for (const std::string& warning : (*baker)->warnings()) log_warning(warning);
  pool_ = std::make_unique<BakePool>(*baker, settings_.threads, [this](const Unit& unit, auto result) {
    loop_.post([this, unit, result = std::move(result)]() mutable { on_done(unit, std::move(result)); });
  });
  if (!class_.empty()) offer();
}

void Agent::offer() {
  if (draining_) return;
  send(Credits{job_->id, settings_.threads + kPrefetchUnits});
  for (const auto& [unit, result] : kept_) send(result);
}

void Agent::take_unit(Unit& unit) {
  if (waiting_job_) return;  // of the old job
  if (!pool_ || unit.job != job_->id) return break_connection("a unit of a job that is not ready");
  if (draining_) return send(Drain{{unit.unit.id}, "draining"});
  ++running_;
  pool_->add(std::move(unit));
}

void Agent::on_done(const Unit& unit, Expected<UnitResult> result) {
  --running_;
  if (waiting_job_) return start_waiting_job();
  deliver(unit, std::move(result));
  leave_if_drained();
}

void Agent::deliver(const Unit& unit, Expected<UnitResult> result) {
  if (!result)
    return send(UnitFailed{unit.job, unit.unit.id, unit.lease, result.error().kind, result.error().message});
  const Digest digest = result_digest(*result);
  send(kept_.insert_or_assign(unit.unit.id, Result{unit.job, unit.lease, std::move(*result), digest})
           .first->second);
}

void Agent::on_ack(const CommitAck& ack) {
  const auto it = kept_.find(ack.unit);
  if (it != kept_.end() && it->second.digest == ack.digest) kept_.erase(it);
  leave_if_drained();
}

}  // namespace kiln

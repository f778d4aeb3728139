// The store's operations on workers, and the effect of a quarantine on jobs.
#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/store_impl.h"

namespace kiln {
namespace {

constexpr size_t kMaxIdentity = 256, kMaxReason = 4096;  // bytes

// Adds to the unproved part of a job's result.
Status taint(GroupTransaction& t, JobRecord job, uint64_t units, const std::string& worker,
             const std::string& reason) {
  constexpr size_t kMax = 4000;
  KILN_CHECK(job.id != 0);
  job.tainted = true;
  const std::string sentence = text("{} {}{}", units, suspect_words(worker), reason);
  if (job.taint.find(sentence) == std::string::npos && job.taint.size() + sentence.size() < kMax)
    job.taint += (job.taint.empty() ? "" : "; ") + sentence;
  KILN_TRY_STATUS(t.tables().set_job(job, false));
  t.set_job(std::move(job));
  return {};
}

Status set_worker(GroupTransaction& t, WorkerRecord worker) {
  KILN_CHECK(!worker.identity.empty() && worker.identity.size() <= kMaxIdentity);
  KILN_TRY_STATUS(t.tables().put_worker(worker));
  t.set_worker(std::move(worker));
  return {};
}

Expected<WorkerRecord> worker_or_new(const GroupTransaction& t, const std::string& identity, int64_t at_ms) {
  if (identity.empty() || identity.size() > kMaxIdentity)
    return fail(ErrorKind::kInvalidInput, "a worker's identity is empty or too long");
  WorkerRecord worker = t.worker(identity).value_or(WorkerRecord{});
  worker.identity = identity;
  if (!worker.first_seen_ms) worker.first_seen_ms = at_ms;
  worker.last_seen_ms = at_ms;
  return worker;
}

}  // namespace

void StoreImpl::put_worker(const WorkerRecord& worker, Callback done) {
  Operation operation;
  operation.apply = [worker](GroupTransaction& t) -> Status {
    if (worker.identity.empty() || worker.identity.size() > kMaxIdentity ||
        worker.quarantine_reason.size() > kMaxReason || worker.numeric_classes.size() > 64)
      return fail(ErrorKind::kInvalidInput,
                  text("the record of worker '{}' is too long, or it has no identity",
                       worker.identity.substr(0, kMaxIdentity)));
    KILN_TRY_STATUS(t.tables().put_worker(worker));
    t.set_worker(worker);
    return {};
  };
  give(std::move(operation), std::move(done));
}

Status StoreImpl::forgive(const std::string& identity) {
  Operation operation;
  operation.apply = [&](GroupTransaction& t) -> Status {
    auto worker = t.worker(identity);
    if (!worker) return fail(ErrorKind::kInvalidInput, text("there is no worker '{}'", identity));
    worker->quarantined = false;
    worker->quarantine_reason.clear();
    worker->good_verifications = worker->failures = 0;
    KILN_TRY_STATUS(t.tables().put_worker(*worker));
    t.set_worker(std::move(*worker));
    return {};
  };
  return writer_.give_and_wait(std::move(operation));
}

void StoreImpl::note_trust(const std::string& identity, uint64_t agreed, int64_t at_ms, Callback done) {
  Operation operation;
  operation.apply = [=](GroupTransaction& t) -> Status {
    KILN_TRY(WorkerRecord worker, worker_or_new(t, identity, at_ms));
    worker.good_verifications = agreed;
    return set_worker(t, std::move(worker));
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::quarantine(const std::string& identity, const std::string& given, int64_t at_ms,
                           Callback done) {
  Operation operation;
  operation.apply = [=, reason = given.substr(0, kMaxReason)](GroupTransaction& t) -> Status {
    KILN_TRY(WorkerRecord worker, worker_or_new(t, identity, at_ms));
    worker.quarantined = true;
    worker.quarantine_reason = reason;
    worker.good_verifications = 0;
    KILN_TRY_STATUS(set_worker(t, std::move(worker)));
    KILN_TRY(const auto unproven, t.tables().load_unproven(identity));
    for (const auto& row : unproven)
      if (auto job = t.job(row.job)) KILN_TRY_STATUS(taint(t, std::move(*job), row.units, identity, reason));
    return {};
  };
  give(std::move(operation), std::move(done));
}

Status StoreImpl::conclude(JobId id, const Edit& edit) {
  Operation operation;
  operation.apply = [id, change = change_of(id, edit)](GroupTransaction& t) -> Status {
    KILN_TRY_STATUS(change.apply(t));
    KILN_TRY_STATUS(t.tables().note_unproven(id));
    KILN_TRY(const auto unproven, t.tables().load_unproven(id));
    for (const auto& row : unproven) {
      const auto worker = t.worker(row.worker);
      KILN_CHECK(t.has_job(id));
      if (worker && worker->quarantined)
        KILN_TRY_STATUS(taint(t, *t.job(id), row.units, row.worker, worker->quarantine_reason));
    }
    return t.tables().drop_results(id);
  };
  operation.after = [this, id]() -> Status {
    writer_.spool().drop(id);
    return {};
  };
  return writer_.give_and_wait(std::move(operation));
}

}  // namespace kiln

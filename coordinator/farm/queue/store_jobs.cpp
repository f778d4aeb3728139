// The store's operations on jobs.
#include <algorithm>
#include <set>

#include "common/base/format.h"
#include "coordinator/farm/queue/store_impl.h"

namespace kiln {
namespace {

constexpr size_t kMaxEvent = 4096;  // bytes

tl::unexpected<Error> no_job(JobId id) {
  return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
}

bool same_description(const JobRecord& a, const JobRecord& b) {
  return a.scene == b.scene && a.settings == b.settings && a.after == b.after && a.inputs == b.inputs &&
         a.results == b.results;
}

// Jobs for which an unended job waits.
std::set<JobId> awaited(const std::vector<JobRecord>& jobs) {
  std::set<JobId> ids;
  for (const JobRecord& job : jobs)
    if (!job_ended(job.state)) ids.insert(job.after.begin(), job.after.end());
  return ids;
}

Status remove(GroupTransaction& t, JobId id) {
  KILN_TRY_STATUS(t.tables().drop_results(id));
  KILN_TRY_STATUS(t.tables().remove_job(id));
  t.remove_job(id);
  return {};
}

}  // namespace

Expected<JobId> StoreImpl::submit(const JobRecord& job) {
  KILN_TRY_STATUS(check_job(job));
  JobId id = 0;
  Operation operation;
  operation.apply = [&](GroupTransaction& t) -> Status {
    for (const JobId other : job.after)
      if (!t.has_job(other))
        return fail(ErrorKind::kInvalidInput, text("the job waits for job {}, which does not exist", other));
    if (!job.submission.empty()) {
      KILN_TRY(id, t.tables().find_submission(job.user, job.submission));
      if (id) return {};
    }
    KILN_TRY(id, t.tables().add_job(job));
    JobRecord stored = job;
    stored.id = id;
    t.set_job(std::move(stored));
    return {};
  };
  KILN_TRY_STATUS(writer_.give_and_wait(std::move(operation)));
  return id;
}

Operation StoreImpl::update_of(const JobRecord& job) {
  return change_of(job.id, [job](JobRecord& record) -> Status {
    record = job;
    return {};
  });
}

Operation StoreImpl::change_of(JobId id, const Edit& edit) {
  Operation operation;
  operation.apply = [id, edit](GroupTransaction& t) -> Status {
    const auto stored = t.job(id);
    if (!stored) return no_job(id);
    JobRecord job = *stored;
    KILN_TRY_STATUS(edit(job));
    KILN_TRY_STATUS(check_job(job));
    // Jobs wait only for older ones, so there are no cycles.
    for (const JobId other : job.after)
      if (other >= job.id)
        return fail(ErrorKind::kInvalidInput,
                    text("job {} cannot wait for job {}, which came after it", job.id, other));
    KILN_TRY_STATUS(t.tables().set_job(job, !same_description(job, *stored)));
    t.set_job(job);
    return {};
  };
  return operation;
}

void StoreImpl::pin_class(JobId id, const std::string& numeric_class, Callback done) {
  Operation operation;
  operation.apply = [=](GroupTransaction& t) -> Status {
    auto job = t.job(id);
    if (!job) return no_job(id);
    job->numeric_class = numeric_class;
    KILN_TRY_STATUS(check_job(*job));
    KILN_TRY_STATUS(t.tables().set_job(*job, false));
    t.set_job(std::move(*job));
    return {};
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::event(JobId job, int64_t at_ms, std::string text) {
  if (text.size() > kMaxEvent) text.resize(kMaxEvent);
  Operation operation;
  operation.apply = [this, job, at_ms, text = std::move(text)](GroupTransaction& t) -> Status {
    if (!t.has_job(job)) return no_job(job);
    return t.tables().add_event(job, at_ms, text, options_.events_per_job);
  };
  give(std::move(operation), nullptr);
}

Status StoreImpl::forget(JobId id) {
  Operation operation;
  operation.removes = true;
  operation.apply = [id](GroupTransaction& t) -> Status {
    const auto job = t.job(id);
    if (!job) return no_job(id);
    if (!job_ended(job->state))
      return fail(ErrorKind::kUsage,
                  text("job {} is {}: cancel it before it is forgotten", id, job_state_name(job->state)));
    if (awaited(t.jobs()).count(id))
      return fail(ErrorKind::kUsage,
                  text("job {} is awaited by another job and cannot be forgotten yet", id));
    return remove(t, id);
  };
  operation.after = [this, id]() -> Status {
    writer_.spool().drop(id);
    return {};
  };
  return writer_.give_and_wait(std::move(operation));
}

Expected<std::vector<JobId>> StoreImpl::forget_ended(int64_t before_ms) {
  std::vector<JobId> forgotten;
  Operation operation;
  operation.removes = true;
  operation.apply = [&](GroupTransaction& t) -> Status {
    forgotten.clear();
    const std::vector<JobRecord> jobs = t.jobs();
    const std::set<JobId> kept = awaited(jobs);
    for (const JobRecord& job : jobs) {
      if (!job_ended(job.state) || job.ended_ms >= before_ms || kept.count(job.id)) continue;
      KILN_TRY_STATUS(remove(t, job.id));
      forgotten.push_back(job.id);
    }
    return {};
  };
  operation.after = [&]() -> Status {
    for (const JobId id : forgotten) writer_.spool().drop(id);
    return {};
  };
  KILN_TRY_STATUS(writer_.give_and_wait(std::move(operation)));
  return forgotten;
}

}  // namespace kiln

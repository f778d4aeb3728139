// Results whose bytes are no longer what was published: a job that published them is baked again.
#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/service_impl.h"

namespace kiln {
namespace {

const FileRecord* result_of(const JobRecord& job, const Digest& digest) {
  const auto file = std::find_if(job.results.begin(), job.results.end(),
                                 [&](const FileRecord& f) { return f.digest == digest; });
  return file == job.results.end() ? nullptr : &*file;
}

}  // namespace

Status ServiceImpl::check_result(JobId job, const FileRecord& file) {
  KILN_TRY(const BlobState state, blobs_->verify(file.digest));
  if (state == BlobState::kIntact) return {};
  KILN_TRY(const JobId baker, bake_again(file.digest, job));
  const std::string whose = baker == job ? "the job is" : text("job {}, which has the same file, is", baker);
  return fail(
      ErrorKind::kUnavailable,
      text("the coordinator's copy of {} of job {} {}: {} baked again; `kiln watch {}`, then fetch it",
           file.path, job,
           state == BlobState::kDamaged ? "was damaged on its disk" : "has gone from its disk", whose,
           baker));
}

// The units' results went when the job was done, so all of it is baked, by the same numeric class: its files
// will have the same bytes. So one job is enough for all that published the file; a second is taken only when
// the first has ended and the file is still missing.
Expected<JobId> ServiceImpl::bake_again(const Digest& lost, JobId asked) {
  const std::lock_guard one_at_a_time(lost_mutex_);
  const std::vector<JobRecord> jobs = store_->jobs();
  const auto of = [&](JobId id) {
    const auto job = std::find_if(jobs.begin(), jobs.end(), [&](const JobRecord& j) { return j.id == id; });
    return job == jobs.end() ? nullptr : &*job;
  };
  if (const auto under_way = bakers_.find(lost); under_way != bakers_.end()) {
    const JobRecord* baker = of(under_way->second);
    if (baker && !job_ended(baker->state)) return baker->id;
  }
  const auto has_it = [&](const JobRecord& job) {
    return job.state == JobState::kDone && result_of(job, lost);
  };
  const JobRecord* baker = asked ? of(asked) : nullptr;
  if (!baker || !has_it(*baker)) {
    const auto first = std::find_if(jobs.begin(), jobs.end(), has_it);
    baker = first == jobs.end() ? nullptr : &*first;
  }
  if (!baker) return asked;  // another reader saw it first
  const std::string reason =
      text("its result {} (blob {}) is damaged on the coordinator's disk, or gone from it: it is baked again",
           result_of(*baker, lost)->path, lost.hex());
  KILN_TRY_STATUS(store_->change(baker->id, [&](JobRecord& job) -> Status {
    if (job.state != JobState::kDone) return {};
    job.state = JobState::kQueued;
    job.reason = reason;
    job.preparations = 0;
    job.ended_ms = 0;
    job.results.clear();
    job.tainted = false;
    job.taint.clear();
    job.verification.clear();
    return {};
  }));
  bakers_[lost] = baker->id;
  const auto others = std::count_if(jobs.begin(), jobs.end(), has_it) - 1;
  log_warning(text("job {}: {}{}", baker->id, reason,
                   others > 0 ? text(", also for {} other jobs that published it", others) : ""));
  note(baker->id, reason);
  wake();
  return baker->id;
}

}  // namespace kiln

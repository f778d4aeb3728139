// Results whose bytes are no longer what was published: their jobs are baked again.
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/service_impl.h"

namespace kiln {

Status ServiceImpl::check_result(JobId job, const FileRecord& file) {
  KILN_TRY(const BlobState state, blobs_->verify(file.digest));
  if (state == BlobState::kIntact) return {};
  KILN_TRY_STATUS(bake_again(file.digest));
  return fail(ErrorKind::kUnavailable,
              text("the coordinator's copy of {} of job {} {}: the job is baked again; `kiln watch {}`, then "
                   "fetch it",
                   file.path, job,
                   state == BlobState::kDamaged ? "was damaged on its disk" : "has gone from its disk", job));
}

// The units' results went when the job was done, so all of it is baked, by the same numeric class: the
// lightmaps will have the same bytes.
Status ServiceImpl::bake_again(const Digest& lost) {
  for (const JobRecord& done : store_->jobs()) {
    std::string reason;
    for (const FileRecord& file : done.results)
      if (file.digest == lost && reason.empty())
        reason = text(
            "its result {} (blob {}) is damaged on the coordinator's disk, or gone from it: it is baked "
            "again",
            file.path, lost.hex());
    if (reason.empty() || done.state != JobState::kDone) continue;
    bool changed = false;
    KILN_TRY_STATUS(store_->change(done.id, [&](JobRecord& job) -> Status {
      changed = job.state == JobState::kDone;
      if (!changed) return {};  // another reader saw it first
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
    if (!changed) continue;
    log_warning(text("job {}: {}", done.id, reason));
    note(done.id, reason);
  }
  wake();
  return {};
}

}  // namespace kiln

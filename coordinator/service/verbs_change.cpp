#include "common/base/format.h"
#include "coordinator/service/fields.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/verbs.h"

namespace kiln {
namespace {

constexpr int64_t kMaxId = int64_t{1} << 62;

// The job named in the request, if the caller may change it.
Expected<JobId> own_job(const Ask& ask) {
  KILN_TRY(const int64_t number, number_field(ask.document, "id", 1, kMaxId));
  const auto id = static_cast<JobId>(number);
  const auto job = ask.service.store().job(id);
  if (!job) return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
  if (ask.caller.access < Access::kAdmin && job->user != ask.caller.user)
    return fail(ErrorKind::kUsage, text("job {} is {}'s: {} may change only their own jobs, an admin any", id,
                                        job->user, ask.caller.user));
  return id;
}

Expected<std::string> retry_suspects(const Ask& ask) {
  KILN_TRY(const std::string worker, text_field(ask.document, "suspect", 256, ""));
  JsonWriter w;
  w.begin_object().key("ids").begin_array();
  uint64_t others = 0;
  for (const JobRecord& job : ask.service.store().jobs()) {
    if (!job.result_is_suspect(worker)) continue;
    if (ask.caller.access < Access::kAdmin && job.user != ask.caller.user) {
      ++others;
      continue;
    }
    if (ask.service.retry(job.id)) w.value(job.id);
  }
  return w.end_array().pair("of_others", others).end_object().take();
}

Expected<std::string> done(JobId id, const Status& status) {
  KILN_TRY_STATUS(status);
  return JsonWriter().begin_object().pair("id", id).end_object().take();
}

}  // namespace

Expected<std::string> verb_cancel(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id"}));
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.cancel(id, ask.caller.user));
}

Expected<std::string> verb_pause(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id"}));
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.set_paused(id, true));
}

Expected<std::string> verb_resume(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id"}));
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.set_paused(id, false));
}

Expected<std::string> verb_priority(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id", "priority"}));
  KILN_TRY(const int64_t priority, number_field(ask.document, "priority", -100, 100));
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.set_priority(id, static_cast<int32_t>(priority)));
}

// {"id"}, or {"suspect": NAME}: all published jobs with results that only the quarantined worker NAME gave,
// or any quarantined worker if NAME is empty. Unit results are dropped when a job is published, so it is
// baked whole.
Expected<std::string> verb_retry(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id", "suspect"}));
  if (ask.document.find("suspect")) return retry_suspects(ask);
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.retry(id));
}

Expected<std::string> verb_forget(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id"}));
  KILN_TRY(const JobId id, own_job(ask));
  return done(id, ask.service.store().forget(id));
}

}  // namespace kiln

#include <ctime>

#include "common/base/format.h"
#include "coordinator/farm/authority/tokens.h"
#include "coordinator/farm/documents/farm_documents.h"
#include "coordinator/service/fields.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/turn.h"
#include "coordinator/service/verbs.h"

namespace kiln {
namespace {

constexpr int64_t kMaxId = int64_t{1} << 62;

constexpr size_t kMaxEvents = 1000;

std::string events_document(ServiceImpl& service, uint64_t cursor, JobId job) {
  const std::vector<ServiceEvent> events = service.events().since(cursor, job, kMaxEvents);
  JsonWriter w;
  w.begin_object().key("events").begin_array();
  for (const ServiceEvent& e : events)
    w.begin_object().pair("at_ms", e.at_ms).pair("job", e.job).pair("text", e.text).end_object();
  return w.end_array().pair("next", cursor).end_object().take();
}

std::string lines_document(const std::vector<std::string>& lines) {
  JsonWriter w;
  w.begin_object().key("why").begin_array();
  for (const std::string& line : lines) w.value(line);
  return w.end_array().end_object().take();
}

// The queue rule that holds the job back before the farm has it.
std::vector<std::string> why_queued(ServiceImpl& service, const JobRecord& job) {
  const std::string name = text("job {}", job.id);
  if (job.state == JobState::kWaiting) {
    std::vector<std::string> lines;
    for (const JobId other : job.after) {
      const auto awaited = service.store().job(other);
      lines.push_back(text("{} waits for job {}, which is {}", name, other,
                           awaited ? job_state_name(awaited->state) : "forgotten"));
    }
    return lines;
  }
  if (job_ended(job.state)) {
    std::vector<std::string> lines = {
        text("{} is {}{}{}", name, job_state_name(job.state), job.reason.empty() ? "" : ": ", job.reason)};
    if (!job.verification.empty()) lines.push_back(job.verification);
    if (!job.taint.empty()) lines.push_back(text("it is tainted: {}", job.taint));
    return lines;
  }
  if (job.paused) return {text("{} is paused: `kiln resume {}`", name, job.id)};
  if (!job.reason.empty() && job.reason.starts_with("waits for space"))
    return {text("{} {}", name, job.reason)};
  uint32_t active = 0, of_user = 0;
  for (const JobRecord& other : service.store().jobs()) {
    active += is_active(other.state);
    of_user += is_active(other.state) && other.user == job.user;
  }
  const JobId next = next_job(service.store().jobs(), [](JobId) { return true; });
  return {text(
      "{} is queued: {} of at most {} jobs are active, {} of them {}'s; next is {}: users with the fewest "
      "active jobs come first, then higher priority, then the older job",
      name, active, service.settings().active_jobs, of_user, job.user,
      next == job.id ? "this one"
      : next         ? text("job {}", next)
                     : "none")};
}

}  // namespace

Expected<std::string> verb_why(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"job", "unit", "worker"}));
  KILN_TRY(const std::string worker, text_field(ask.document, "worker", 256, ""));
  if (!worker.empty()) return lines_document(ask.service.farm().why_worker(worker));
  KILN_TRY(const int64_t number, number_field(ask.document, "job", 1, kMaxId));
  KILN_TRY(const int64_t unit, number_field(ask.document, "unit", 0, kMaxId, -1));
  const auto id = static_cast<JobId>(number);
  const auto job = ask.service.store().job(id);
  if (!job) return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
  std::vector<std::string> lines;
  if (const std::string held = ask.service.held_for(); !held.empty())
    lines.push_back(text("nothing is handed out, because the disk cannot be written: {}", held));
  const auto progress = ask.service.progress_of(id);
  if (!progress) {
    for (std::string& line : why_queued(ask.service, *job)) lines.push_back(std::move(line));
    return lines_document(lines);
  }
  if (progress->stage != "bake")
    lines.push_back(
        text("job {} is at the stage '{}', which the coordinator does itself", id, progress->stage));
  for (std::string& line : unit >= 0 ? ask.service.farm().why_unit(id, static_cast<uint64_t>(unit))
                                     : ask.service.farm().why_job(id))
    lines.push_back(std::move(line));
  return lines_document(lines);
}

Expected<std::string> verb_workers(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {}));
  return workers_document(ask.service.source());
}

Expected<std::string> verb_forgive(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"worker"}));
  KILN_TRY(const std::string worker, text_field(ask.document, "worker", 256));
  KILN_TRY_STATUS(ask.service.forgive(worker));
  return JsonWriter().begin_object().pair("worker", worker).end_object().take();
}

Expected<std::string> verb_status(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {}));
  return status_document(ask.service.source());
}

Expected<std::string> verb_events(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"since", "job"}));
  KILN_TRY(const int64_t since, number_field(ask.document, "since", 0, kMaxId, 0));
  KILN_TRY(const int64_t job, number_field(ask.document, "job", 0, kMaxId, 0));
  return events_document(ask.service, static_cast<uint64_t>(since), static_cast<JobId>(job));
}

Expected<std::string> verb_enrol(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"token", "request"}));
  KILN_TRY(const std::string token, text_field(ask.document, "token", 256));
  KILN_TRY(const std::string request, text_field(ask.document, "request", 16384));
  std::error_code code;
  if (!std::filesystem::exists(ask.service.settings().authority / "ca.key", code))
    return fail(
        ErrorKind::kUsage,
        "this coordinator cannot sign certificates: its authority is elsewhere; ask for one made there");
  KILN_TRY(const Enrolment enrolment, redeem_token(ask.service.settings().authority, token, request,
                                                   static_cast<int64_t>(std::time(nullptr))));
  return JsonWriter()
      .begin_object()
      .pair("certificate", enrolment.certificate)
      .pair("authority", enrolment.authority)
      .end_object()
      .take();
}

}  // namespace kiln

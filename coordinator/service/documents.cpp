#include "coordinator/service/documents.h"

#include <algorithm>
#include <map>

#include "common/base/format.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/turn.h"
#include "coordinator/service/unix_time.h"

namespace kiln {
namespace {

constexpr size_t kMaxEvents = 1000;

void write_files(JsonWriter& w, const char* name, const std::vector<FileRecord>& files) {
  w.key(name).begin_array();
  for (const FileRecord& f : files)
    w.begin_object().pair("path", f.path).pair("digest", f.digest.hex()).pair("size", f.size).end_object();
  w.end_array();
}

using FarmJobs = std::map<JobId, FarmJobStatus>;

FarmJobs farm_jobs(const FarmStatus& status) {
  FarmJobs jobs;
  for (const FarmJobStatus& job : status.jobs) jobs[job.job] = job;
  return jobs;
}

double rays_per_second(const FarmStatus& status, JobId job) {
  double rate = 0;
  for (const WorkerStatus& worker : status.workers)
    if (worker.job == job) rate += worker.rays_per_second;
  return rate;
}

void write_job(JsonWriter& w, ServiceImpl& service, const FarmStatus& status, const FarmJobs& farm,
               const JobRecord& job) {
  const std::string held = service.held_for();
  // Also a job that an earlier coordinator left active and that cannot be taken up yet.
  const bool running = service.is_running(job.id) || is_active(job.state);
  w.pair("id", job.id).pair("name", job.name).pair("user", job.user).pair("priority", job.priority);
  w.pair("state", std::string(job_state_name(job.state))).pair("paused", job.paused);
  w.pair("reason", running && !held.empty() ? "the disk cannot be written, work waits: " + held : job.reason);
  w.key("after").begin_array();
  for (const JobId other : job.after) w.value(other);
  w.end_array().pair("quorum", job.quorum);
  w.pair("on_poison", job.poison == PoisonPolicy::kSkip ? "skip" : "fail").pair("scene", job.scene);
  w.pair("submitted_ms", job.submitted_ms).pair("started_ms", job.started_ms).pair("ended_ms", job.ended_ms);
  w.pair("passes_done", job.passes_done).pair("converged_share", job.converged_share);
  w.pair("numeric_class", job.numeric_class).pair("tainted", job.tainted).pair("taint", job.taint);
  w.pair("verification", job.verification);
  const auto progress = service.progress_of(job.id);
  if (!progress) return;
  w.key("progress").begin_object().pair("stage", progress->stage).pair("pass", progress->pass);
  w.pair("seconds_left", progress->seconds_left);
  const auto it = farm.find(job.id);
  const FarmJobStatus now = it == farm.end() ? FarmJobStatus{} : it->second;
  w.pair("units_done", now.units_done)
      .pair("units_total", now.units_total)
      .pair("units_failed", now.units_failed);
  w.pair("pass_share", now.weight > 0 ? now.weight_done / now.weight : 0.0);
  w.pair("workers", now.workers).pair("threads", now.threads).pair("rays", now.rays);
  w.pair("rays_per_second", rays_per_second(status, job.id));
  w.pair("verified", now.verified)
      .pair("unverified", now.unverified)
      .pair("waived", now.waived)
      .pair("disputes", now.disputes)
      .end_object();
}

}  // namespace

std::string jobs_document(ServiceImpl& service, const JobsPage& page) {
  std::vector<JobRecord> jobs = service.store().jobs();
  std::reverse(jobs.begin(), jobs.end());
  const FarmStatus status = service.farm().status();
  const FarmJobs farm = farm_jobs(status);
  JsonWriter w;
  w.begin_object().key("jobs").begin_array();
  size_t count = 0;
  bool more = false;
  for (const JobRecord& job : jobs) {
    if (page.before && job.id >= page.before) continue;
    if (count == page.most) {
      more = true;
      break;
    }
    ++count;
    w.begin_object();
    write_job(w, service, status, farm, job);
    w.end_object();
  }
  return w.end_array().pair("more", more).end_object().take();
}

Expected<std::string> job_document(ServiceImpl& service, JobId id) {
  const auto job = service.store().job(id);
  if (!job) return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
  KILN_TRY(const std::vector<JobEvent> events, service.store().events(id));
  const FarmStatus status = service.farm().status();
  JsonWriter w;
  w.begin_object();
  write_job(w, service, status, farm_jobs(status), *job);
  w.pair("settings", job->settings);
  write_files(w, "results", job->results);
  w.key("events").begin_array();
  for (const JobEvent& e : events) w.begin_object().pair("at_ms", e.at_ms).pair("text", e.text).end_object();
  return w.end_array().end_object().take();
}

std::string workers_document(ServiceImpl& service) {
  const FarmStatus status = service.farm().status();
  JsonWriter w;
  w.begin_object().key("workers").begin_array();
  for (const WorkerStatus& k : status.workers) {
    w.begin_object().pair("id", k.id).pair("name", k.name).pair("identity", k.identity).pair("peer", k.peer);
    w.pair("owner", k.owner);
    w.pair("release", k.release).pair("threads", k.threads).pair("job", k.job).pair("state", k.state);
    w.pair("units_held", k.units_held).pair("units_done", k.units_done).pair("units_failed", k.units_failed);
    w.pair("rays", k.rays).pair("rays_per_second", k.rays_per_second).pair("agreed", k.agreed);
    w.pair("queued_bytes", k.queued_bytes).end_object();
  }
  w.end_array().key("quarantined").begin_array();
  const std::vector<JobRecord> jobs = service.store().jobs();
  for (const WorkerRecord& record : service.store().workers()) {
    if (!record.quarantined) continue;
    w.begin_object().pair("identity", record.identity).pair("reason", record.quarantine_reason);
    w.key("suspect_jobs").begin_array();
    for (const JobRecord& job : jobs)
      if (job.result_is_suspect(record.identity)) w.value(job.id);
    w.end_array().end_object();
  }
  return w.end_array().end_object().take();
}

std::string status_document(ServiceImpl& service) {
  const FarmStatus status = service.farm().status();
  std::map<JobState, uint64_t> states;
  for (const JobRecord& job : service.store().jobs()) ++states[job.state];
  JsonWriter w;
  w.begin_object().pair("release", service.settings().release).pair("epoch", service.store().epoch());
  w.pair("now_ms", unix_ms());
  w.pair("held_for", service.held_for()).pair("clock_doubt", service.clock_doubt());
  if (const auto& tls = service.settings().farm.tls) {
    const RevocationLists::Extent revoked = tls->revocations();
    w.pair("revoked_lists", uint64_t{revoked.files}).pair("revoked_serials", uint64_t{revoked.serials});
  }
  w.key("jobs").begin_object();
  for (uint8_t s = 0; s <= static_cast<uint8_t>(JobState::kCancelled); ++s)
    w.pair(job_state_name(static_cast<JobState>(s)), states[static_cast<JobState>(s)]);
  w.end_object()
      .pair("workers", static_cast<uint64_t>(status.workers.size()))
      .pair("clients", status.clients);
  w.pair("connections", status.connections)
      .pair("results", status.results)
      .pair("duplicates", status.duplicates);
  w.pair("refused_connections", status.refused_connections).pair("expelled", status.expelled);
  return w.end_object().take();
}

std::string events_document(ServiceImpl& service, uint64_t cursor, JobId job) {
  const std::vector<ServiceEvent> events = service.events().since(cursor, job, kMaxEvents);
  JsonWriter w;
  w.begin_object().key("events").begin_array();
  for (const ServiceEvent& e : events)
    w.begin_object().pair("at_ms", e.at_ms).pair("job", e.job).pair("text", e.text).end_object();
  return w.end_array().pair("next", cursor).end_object().take();
}

}  // namespace kiln

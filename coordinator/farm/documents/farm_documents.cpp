#include "coordinator/farm/documents/farm_documents.h"

#include <algorithm>
#include <map>

#include "common/base/json.h"

namespace kiln {
namespace {

// The farm's part of a job, and its workers' speed.
struct ActiveJob {
  FarmJobStatus status;
  double rays_per_second = 0;
};
using ActiveJobs = std::map<JobId, ActiveJob>;

ActiveJobs active_jobs(const FarmStatus& farm) {
  ActiveJobs jobs;
  for (const FarmJobStatus& job : farm.jobs) jobs[job.job].status = job;
  for (const WorkerStatus& worker : farm.workers)
    if (const auto it = jobs.find(worker.job); it != jobs.end())
      it->second.rays_per_second += worker.rays_per_second;
  return jobs;
}

void write_progress(JsonWriter& w, const JobProgress& progress, const ActiveJob& active) {
  const FarmJobStatus& now = active.status;
  w.key("progress").begin_object().pair("stage", progress.stage).pair("pass", progress.pass);
  w.pair("seconds_left", progress.seconds_left);
  w.pair("units_done", now.units_done).pair("units_total", now.units_total);
  w.pair("units_failed", now.units_failed);
  w.pair("pass_share", now.weight > 0 ? now.weight_done / now.weight : 0.0);
  w.pair("workers", now.workers).pair("threads", now.threads).pair("rays", now.rays);
  w.pair("rays_per_second", active.rays_per_second);
  w.pair("verified", now.verified).pair("unverified", now.unverified).pair("waived", now.waived);
  w.pair("disputes", now.disputes).end_object();
}

void write_job(JsonWriter& w, const FarmSource& source, const std::string& held, const ActiveJobs& active,
               const JobRecord& job) {
  const auto progress = source.progress(job.id);
  // Also a job that an earlier coordinator left active and that cannot be taken up yet.
  const bool running = progress || (!job_ended(job.state) && job.state >= JobState::kPreparing);
  w.pair("id", job.id).pair("name", job.name).pair("user", job.user).pair("priority", job.priority);
  w.pair("state", job_state_name(job.state)).pair("paused", job.paused);
  w.pair("reason", running && !held.empty() ? "the disk cannot be written, work waits: " + held : job.reason);
  w.key("after").begin_array();
  for (const JobId other : job.after) w.value(other);
  w.end_array().pair("quorum", job.quorum);
  w.pair("on_poison", job.poison == PoisonPolicy::kSkip ? "skip" : "fail").pair("scene", job.scene);
  w.pair("submitted_ms", job.submitted_ms).pair("started_ms", job.started_ms).pair("ended_ms", job.ended_ms);
  w.pair("passes_done", job.passes_done)
      .pair("units_done", job.units_done)
      .pair("converged_share", job.converged_share);
  w.pair("numeric_class", job.numeric_class).pair("tainted", job.tainted).pair("taint", job.taint);
  w.pair("verification", job.verification);
  if (!progress) return;
  const auto it = active.find(job.id);
  write_progress(w, *progress, it == active.end() ? ActiveJob{} : it->second);
}

void write_files(JsonWriter& w, std::string_view name, const std::vector<FileRecord>& files) {
  w.key(name).begin_array();
  for (const FileRecord& f : files)
    w.begin_object().pair("path", f.path).pair("digest", f.digest.hex()).pair("size", f.size).end_object();
  w.end_array();
}

void write_data(JsonWriter& w, const DataReport& data) {
  w.key("data").begin_object();
  w.key("size_bytes").begin_object();
  for (const DataKind& kind : kDataKinds) w.pair(kind.name, data.sizes.*kind.bytes);
  w.pair("total", data.sizes.total()).end_object();
  if (data.bytes_a_day) {
    double total = 0;
    w.key("growth_bytes_a_day").begin_object();
    for (size_t k = 0; k < kDataKinds.size(); ++k) {
      w.pair(kDataKinds[k].name, (*data.bytes_a_day)[k]);
      total += (*data.bytes_a_day)[k];
    }
    w.pair("total", total).end_object();
  }
  w.pair("disk_bytes", data.disk_bytes).pair("free_bytes", data.free_bytes);
  if (data.days_until_full) w.pair("days_until_full", *data.days_until_full);
  w.key("retention").begin_object().pair("keep_days", data.keep_days);
  w.pair("next_ms", data.next.at_ms).key("next_jobs").begin_array();
  for (const JobId job : data.next.jobs) w.value(job);
  w.end_array().pair("next_bytes", data.next.bytes).end_object();
  w.key("backup").begin_object().pair("last_ms", data.backup_ms).pair("jobs", data.backup_jobs);
  w.pair("copied_bytes", data.backup_bytes).end_object().end_object();
}

}  // namespace

std::string jobs_document(const FarmSource& source, const JobsPage& page) {
  std::vector<JobRecord> jobs = source.jobs();
  std::reverse(jobs.begin(), jobs.end());
  const ActiveJobs active = active_jobs(source.farm());
  const std::string held = held_for(source);
  JsonWriter w;
  w.begin_object().key("jobs").begin_array();
  size_t count = 0;
  bool more = false;
  for (const JobRecord& job : jobs) {
    if (page.before && job.id >= page.before) continue;
    more = count == page.most;
    if (more) break;
    ++count;
    w.begin_object();
    write_job(w, source, held, active, job);
    w.end_object();
  }
  return w.end_array().pair("more", more).end_object().take();
}

std::optional<std::string> job_document(const FarmSource& source, JobId id) {
  const auto job = source.job(id);
  if (!job) return std::nullopt;
  JsonWriter w;
  w.begin_object();
  write_job(w, source, held_for(source), active_jobs(source.farm()), *job);
  w.pair("settings", job->settings).pair("preparations", job->preparations);
  write_files(w, "inputs", job->inputs);
  write_files(w, "results", job->results);
  w.key("events").begin_array();
  for (const JobEvent& e : source.events(id))
    w.begin_object().pair("at_ms", e.at_ms).pair("text", e.text).end_object();
  return w.end_array().end_object().take();
}

std::string workers_document(const FarmSource& source) {
  const FarmStatus status = source.farm();
  JsonWriter w;
  w.begin_object().key("workers").begin_array();
  for (const WorkerStatus& k : status.workers) {
    w.begin_object().pair("id", k.id).pair("name", k.name).pair("identity", k.identity).pair("peer", k.peer);
    w.pair("owner", k.owner).pair("release", k.release).pair("threads", k.threads).pair("job", k.job);
    w.pair("state", k.state).pair("credits", k.credits).pair("units_held", k.units_held);
    w.pair("units_done", k.units_done).pair("units_failed", k.units_failed);
    w.pair("rays", k.rays).pair("rays_per_second", k.rays_per_second).pair("agreed", k.agreed);
    w.pair("queued_bytes", k.queued_bytes).end_object();
  }
  w.end_array().key("quarantined").begin_array();
  const std::vector<JobRecord> jobs = source.jobs();
  for (const WorkerRecord& record : source.workers()) {
    if (!record.quarantined) continue;
    w.begin_object().pair("identity", record.identity).pair("reason", record.quarantine_reason);
    w.key("suspect_jobs").begin_array();
    for (const JobRecord& job : jobs)
      if (job.result_is_suspect(record.identity)) w.value(job.id);
    w.end_array().end_object();
  }
  return w.end_array().end_object().take();
}

std::string status_document(const FarmSource& source) {
  const FarmStatus status = source.farm();
  const FarmHealth health = source.health();
  std::map<JobState, uint64_t> states;
  for (const JobRecord& job : source.jobs()) ++states[job.state];
  uint64_t threads = 0, quarantined = 0;
  double rate = 0;
  for (const WorkerStatus& worker : status.workers) {
    threads += worker.threads;
    rate += worker.rays_per_second;
  }
  for (const WorkerRecord& worker : source.workers()) quarantined += worker.quarantined;
  JsonWriter w;
  w.begin_object().pair("release", health.release).pair("epoch", health.epoch).pair("now_ms", health.now_ms);
  w.pair("held_for", held_for(source)).pair("clock_doubt", health.clock_doubt);
  if (health.tls) {
    w.pair("certificate_until_s", health.certificate_until);
    w.pair("revoked_lists", health.revoked_lists).pair("revoked_serials", health.revoked_serials);
  }
  w.key("jobs").begin_object();
  for (uint8_t s = 0; s <= static_cast<uint8_t>(JobState::kCancelled); ++s)
    w.pair(job_state_name(static_cast<JobState>(s)), states[static_cast<JobState>(s)]);
  w.end_object().pair("workers", uint64_t{status.workers.size()}).pair("quarantined", quarantined);
  w.pair("threads", threads).pair("rays_per_second", rate);
  w.pair("clients", status.clients).pair("connections", status.connections).pair("results", status.results);
  w.pair("rays", status.rays).pair("duplicates", status.duplicates);
  w.pair("refused_connections", status.refused_connections).pair("expelled", status.expelled);
  w.pair("store_wal_bytes", health.wal_bytes).pair("verified_bytes", health.verified_bytes);
  w.pair("damaged_blobs", health.damaged_blobs).pair("damaged_results", health.damaged_results);
  write_data(w, health.data);
  return w.end_object().take();
}

std::string held_for(const FarmSource& source) {
  const std::string store = source.health().held_for;
  return store.empty() ? source.farm().held_for : store;
}

}  // namespace kiln

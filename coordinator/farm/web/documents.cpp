#include "coordinator/farm/web/documents.h"

#include <algorithm>

#include "common/base/json.h"

namespace kiln {
namespace {

void write_short(JsonWriter& w, const JobRecord& job, const FarmStatus& farm) {
  w.pair("id", job.id).pair("name", job.name).pair("user", job.user).pair("priority", job.priority);
  w.pair("state", job_state_name(job.state)).pair("paused", job.paused).pair("reason", job.reason);
  w.pair("submitted_ms", job.submitted_ms).pair("started_ms", job.started_ms).pair("ended_ms", job.ended_ms);
  w.pair("passes_done", job.passes_done).pair("units_done", job.units_done);
  w.pair("units_total", job.units_total).pair("texels", job.texels);
  w.pair("worst_relative_error", job.worst_relative_error).pair("converged_share", job.converged_share);
  w.pair("tainted", job.tainted).pair("taint", job.taint).pair("verification", job.verification);
  const auto active = std::find_if(farm.jobs.begin(), farm.jobs.end(),
                                   [&](const FarmJobStatus& j) { return j.job == job.id; });
  if (active == farm.jobs.end()) return;
  w.key("farm").begin_object().pair("pass", active->pass).pair("workers", active->workers);
  w.pair("threads", active->threads).pair("pass_units", active->units_total);
  w.pair("pass_units_done", active->units_done).pair("pass_units_failed", active->units_failed);
  w.pair("weight", active->weight).pair("weight_done", active->weight_done).pair("rays", active->rays);
  w.pair("verified", active->verified).pair("unverified", active->unverified);
  w.pair("waived", active->waived).pair("disputes", active->disputes).end_object();
}

void write_files(JsonWriter& w, std::string_view name, const std::vector<FileRecord>& files) {
  w.key(name).begin_array();
  for (const FileRecord& f : files)
    w.begin_object().pair("path", f.path).pair("sha256", f.digest.hex()).pair("size", f.size).end_object();
  w.end_array();
}

}  // namespace

std::string unhealthy(const WebSources& sources) {
  const std::string store = sources.store().held_for;
  return store.empty() ? sources.farm().held_for : store;
}

std::string status_json(const WebSources& sources) {
  const FarmStatus farm = sources.farm();
  const StoreHealth store = sources.store();
  JsonWriter w;
  w.begin_object().pair("release", sources.release);
  w.pair("held_for", store.held_for.empty() ? farm.held_for : store.held_for);
  w.pair("store_wal_bytes", store.wal_bytes)
      .pair("connections", farm.connections)
      .pair("clients", farm.clients);
  w.pair("results", farm.results).pair("rays", farm.rays).pair("duplicates", farm.duplicates);
  w.pair("refused_connections", farm.refused_connections).pair("expelled", farm.expelled);
  w.key("workers").begin_array();
  for (const WorkerStatus& worker : farm.workers) {
    w.begin_object().pair("id", worker.id).pair("name", worker.name).pair("identity", worker.identity);
    w.pair("peer", worker.peer).pair("release", worker.release).pair("threads", worker.threads);
    w.pair("job", worker.job).pair("state", worker.state).pair("units_held", worker.units_held);
    w.pair("credits", worker.credits).pair("units_done", worker.units_done);
    w.pair("units_failed", worker.units_failed).pair("rays", worker.rays);
    w.pair("rays_per_second", worker.rays_per_second).pair("agreed", worker.agreed);
    w.pair("queued_bytes", worker.queued_bytes).end_object();
  }
  return w.end_array().end_object().take();
}

std::string jobs_json(const WebSources& sources) {
  const FarmStatus farm = sources.farm();
  JsonWriter w;
  w.begin_object().key("jobs").begin_array();
  for (const JobRecord& job : sources.jobs()) {
    w.begin_object();
    write_short(w, job, farm);
    w.end_object();
  }
  return w.end_array().end_object().take();
}

std::optional<std::string> job_json(const WebSources& sources, JobId id) {
  const std::optional<JobRecord> job = sources.job(id);
  if (!job) return std::nullopt;
  JsonWriter w;
  w.begin_object();
  write_short(w, *job, sources.farm());
  w.pair("quorum", job->quorum).pair("on_poison", job->poison == PoisonPolicy::kSkip ? "skip" : "fail");
  w.pair("scene", job->scene).pair("settings", job->settings).pair("preparations", job->preparations);
  w.key("after").begin_array();
  for (const JobId other : job->after) w.value(other);
  w.end_array();
  write_files(w, "inputs", job->inputs);
  write_files(w, "results", job->results);
  w.key("events").begin_array();
  for (const JobEvent& event : sources.events(id))
    w.begin_object().pair("at_ms", event.at_ms).pair("text", event.text).end_object();
  return w.end_array().end_object().take();
}

}  // namespace kiln

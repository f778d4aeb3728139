#include "coordinator/farm/web/metrics.h"

#include <map>

#include "common/base/format.h"

namespace kiln {
namespace {

class Exposition {
 public:
  // `kind`: "gauge" or "counter". Samples of the metric follow.
  Exposition& metric(const char* name, const char* kind, const char* help) {
    name_ = name;
    out_ += text("# HELP {} {}\n# TYPE {} {}\n", name, help, name, kind);
    return *this;
  }
  template <class Number>
  Exposition& sample(Number value, const std::string& labels = "") {
    out_ += labels.empty() ? text("{} {}\n", name_, value) : text("{}{{{}}} {}\n", name_, labels, value);
    return *this;
  }
  std::string take() { return std::move(out_); }

 private:
  const char* name_ = "";
  std::string out_;
};

std::string label(const char* name, const std::string& value) {
  return text("{}=\"{}\"", name, escape_label(value));
}

void write_workers(Exposition& e, const FarmStatus& farm) {
  std::map<std::string, uint64_t> states{{"baking", 0}, {"idle", 0},    {"preparing", 0},
                                         {"silent", 0}, {"leaving", 0}, {"benched", 0}};
  uint64_t threads = 0, held = 0, queued = 0;
  double rate = 0;
  for (const WorkerStatus& w : farm.workers) {
    ++states[w.state];
    threads += w.threads;
    held += w.units_held;
    queued += w.queued_bytes;
    rate += w.rays_per_second;
  }
  e.metric("kiln_workers", "gauge", "Connected workers by state.");
  for (const auto& [state, count] : states) e.sample(count, label("state", state));
  e.metric("kiln_worker_threads", "gauge", "Threads of all connected workers.").sample(threads);
  e.metric("kiln_units_held", "gauge", "Units assigned to workers and not answered yet.").sample(held);
  e.metric("kiln_rays_per_second", "gauge", "Rays a second in the results of the last minute.").sample(rate);
  e.metric("kiln_send_queue_bytes", "gauge", "Bytes queued for workers.").sample(queued);
  e.metric("kiln_connections", "gauge", "Open connections of workers and clients.").sample(farm.connections);
  e.metric("kiln_clients", "gauge", "Open client connections.").sample(farm.clients);
}

void write_totals(Exposition& e, const FarmStatus& farm) {
  e.metric("kiln_results_total", "counter", "Results of units that workers sent.").sample(farm.results);
  e.metric("kiln_rays_total", "counter", "Rays in those results.").sample(farm.rays);
  e.metric("kiln_duplicate_results_total", "counter", "Duplicate results of units.").sample(farm.duplicates);
  e.metric("kiln_refused_connections_total", "counter", "Peers that were refused.")
      .sample(farm.refused_connections);
  e.metric("kiln_expelled_workers_total", "counter", "Workers expelled for wrong answers or hangs.")
      .sample(farm.expelled);
}

void write_queue(Exposition& e, const std::vector<JobRecord>& jobs) {
  std::map<JobState, uint64_t> states;
  for (int s = 0; s <= static_cast<int>(JobState::kCancelled); ++s) states[static_cast<JobState>(s)] = 0;
  uint64_t paused = 0, tainted = 0;
  for (const JobRecord& job : jobs) {
    ++states[job.state];
    paused += job.paused && !job_ended(job.state);
    tainted += job.tainted;
  }
  e.metric("kiln_jobs", "gauge", "Jobs of the queue by state.");
  for (const auto& [state, count] : states)
    e.sample(count, label("state", std::string(job_state_name(state))));
  e.metric("kiln_jobs_paused", "gauge", "Jobs that have not ended and are paused.").sample(paused);
  e.metric("kiln_jobs_tainted", "gauge", "Jobs whose result is partly unproved.").sample(tainted);
}

void write_active_jobs(Exposition& e, const FarmStatus& farm) {
  struct Series {
    const char *name, *help;
    double (*value)(const FarmJobStatus&);
  };
  static const Series kSeries[] = {
      {"kiln_job_pass", "Number of the job's pass since the coordinator started.",
       [](const FarmJobStatus& j) { return double{1} * j.pass; }},
      {"kiln_job_workers", "Workers that serve the job.",
       [](const FarmJobStatus& j) { return double{1} * j.workers; }},
      {"kiln_job_threads", "Threads of those workers.",
       [](const FarmJobStatus& j) { return double{1} * j.threads; }},
      {"kiln_job_pass_units", "Units of the job's pass.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.units_total); }},
      {"kiln_job_pass_units_done", "Units of the pass that have their result.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.units_done); }},
      {"kiln_job_pass_units_failed", "Units of the pass that failed permanently.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.units_failed); }},
      {"kiln_job_units_verified", "Results that another worker confirmed.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.verified); }},
      {"kiln_job_units_unverified", "Results that one worker alone gave.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.unverified); }},
      {"kiln_job_units_waived", "Verifications waived because there was only one machine.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.waived); }},
      {"kiln_job_units_disputed", "Units whose answers differ and are not decided.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.disputes); }},
      {"kiln_job_rays", "Rays in the job's results since it was opened.",
       [](const FarmJobStatus& j) { return static_cast<double>(j.rays); }}};
  for (const Series& series : kSeries) {
    e.metric(series.name, "gauge", series.help);
    for (const FarmJobStatus& job : farm.jobs)
      e.sample(series.value(job), text("job=\"{}\",{}", job.job, label("user", job.user)));
  }
}

void write_data(Exposition& e, const DataReport& data) {
  e.metric("kiln_data_bytes", "gauge", "Size of the data folder by kind.");
  for (const DataKind& kind : kDataKinds) e.sample(data.sizes.*kind.bytes, label("kind", kind.name));
  if (data.bytes_a_day) {
    e.metric("kiln_data_growth_bytes_per_day", "gauge", "Its growth over the last week at most, by kind.");
    for (size_t k = 0; k < kDataKinds.size(); ++k)
      e.sample((*data.bytes_a_day)[k], label("kind", kDataKinds[k].name));
  }
  e.metric("kiln_disk_bytes", "gauge", "Size of the file system of the data folder.").sample(data.disk_bytes);
  e.metric("kiln_disk_free_bytes", "gauge", "Free bytes of it.").sample(data.free_bytes);
  if (data.days_until_full)
    e.metric("kiln_disk_full_in_seconds", "gauge",
             "Time until it is full at that growth; absent: it shrinks.")
        .sample(*data.days_until_full * 86400);
  e.metric("kiln_retention_next_timestamp_seconds", "gauge", "When the next ended jobs are old; 0: never.")
      .sample(data.next.at_ms / 1000);
  e.metric("kiln_retention_next_jobs", "gauge", "Jobs that are forgotten on that day.")
      .sample(data.next.jobs.size());
  e.metric("kiln_backup_last_timestamp_seconds", "gauge", "When the last backup was made; 0: none is known.")
      .sample(data.backup_ms / 1000);
}

}  // namespace

std::string escape_label(const std::string& value) {
  std::string escaped;
  for (const char c : value) {
    if (c == '\\' || c == '"') escaped += '\\';
    if (c == '\n')
      escaped += "\\n";
    else
      escaped += c;
  }
  return escaped;
}

std::string write_metrics(const FarmSource& source) {
  const FarmStatus farm = source.farm();
  const FarmHealth health = source.health();
  const bool held = !farm.held_for.empty() || !health.held_for.empty();
  Exposition e;
  e.metric("kiln_build_info", "gauge", "1; the release is a label.")
      .sample(1, label("release", health.release));
  write_queue(e, source.jobs());
  write_workers(e, farm);
  uint64_t quarantined = 0;
  for (const WorkerRecord& worker : source.workers()) quarantined += worker.quarantined;
  e.metric("kiln_workers_quarantined", "gauge", "Workers that are refused for wrong answers.")
      .sample(quarantined);
  write_totals(e, farm);
  write_active_jobs(e, farm);
  e.metric("kiln_store_wal_bytes", "gauge", "Size of the database's log.").sample(health.wal_bytes);
  e.metric("kiln_store_held", "gauge", "1 while the disk cannot be written and no units are handed out.")
      .sample(held ? 1 : 0);
  e.metric("kiln_store_verified_bytes_total", "counter", "Bytes of stored files held against their digest.")
      .sample(health.verified_bytes);
  e.metric("kiln_store_damaged_blobs_total", "counter", "Stored files that were damaged and set aside.")
      .sample(health.damaged_blobs);
  e.metric("kiln_store_damaged_results_total", "counter",
           "Stored results of units found damaged by the scrub.")
      .sample(health.damaged_results);
  e.metric("kiln_clock_doubted", "gauge", "1 while a leap of the clock keeps anything from being deleted.")
      .sample(health.clock_doubt.empty() ? 0 : 1);
  if (health.tls)
    e.metric("kiln_certificate_expiry_timestamp_seconds", "gauge", "When the coordinator's certificate ends.")
        .sample(health.certificate_until);
  write_data(e, health.data);
  return e.take();
}

}  // namespace kiln

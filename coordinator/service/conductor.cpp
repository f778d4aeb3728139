// Runs one job from the queue to its results.
#include <algorithm>
#include <future>

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/snapshot/snapshot.h"
#include "coordinator/service/job_settings.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/turn.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kFullDiskPauseMs = 30'000;
constexpr auto kDiskPause = std::chrono::milliseconds(500);

// Whatever a library throws, memory that ran out before all, is an error of this job alone.
template <class Task>
auto guarded(JobId id, const Task& task) -> decltype(task()) {
  try {
    return task();
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::kIo,
                text("memory ran out while job {} was worked on: `kiln retry` it when there is "
                     "more, give `kiln serve` fewer --active-jobs, or make the scene smaller",
                     id));
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInternal, text("job {} met an error that should not be: {}", id, e.what()));
  }
}

}  // namespace

fs::path ServiceImpl::work_folder(JobId job) const {
  return settings_.data / "work" / std::to_string(job);
}

Status ServiceImpl::persist(JobId job, const Store::Edit& edit, const Active& active) {
  for (;;) {
    const Status s = store_->change(job, edit);
    if (s || s.error().kind == ErrorKind::kInvalidInput || s.error().kind == ErrorKind::kUsage || active.stop)
      return s;
    results_->suspect();
    std::this_thread::sleep_for(kDiskPause);
  }
}

void ServiceImpl::conduct(JobId id, Active& active) {
  const auto outputs = guarded(id, [&]() -> Expected<std::vector<FileRecord>> {
    note(id, "begun");
    const auto job = store_->job(id);
    if (!job) return fail(ErrorKind::kInternal, text("job {} has gone", id));
    return bake(*job, active);
  });
  // The outputs are stored by now. A job that is seen to have ended has no folder left.
  std::error_code ignored;
  fs::remove_all(work_folder(id), ignored);
  const Status finished = guarded(id, [&]() -> Status {
    finish(id, active, outputs);
    return {};
  });
  if (!finished) log_warning(finished.error().message);
  {
    const std::lock_guard lock(mutex_);
    active.ended = true;
    look_ = true;
  }
  changed_.notify_all();
}

Expected<std::vector<FileRecord>> ServiceImpl::bake(const JobRecord& job, Active& active) {
  const fs::path folder = work_folder(job.id);
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  KILN_TRY_STATUS(lay_out(job.inputs, *blobs_, folder / "scene"));
  BakeRequest request;
  KILN_TRY(BakeSettings settings, read_job_settings(job.settings, job.inputs));
  request.settings = settings_in(std::move(settings), folder / "scene");
  request.settings.unwrap_cache = (settings_.data / "unwrap").string();
  request.scene = folder / "scene" / job.scene;
  request.output = folder / "out";
  request.quorum = job.quorum;
  request.cancelled = &active.stop;
  request.open_job = [&](const JobSpec& spec, const ChunkStore& chunks) {
    return open_job(job, spec, chunks, active);
  };
  request.cut = [&](uint32_t pass, uint32_t chosen) { return cut(job.id, pass, chosen); };
  KILN_TRY_STATUS(check_apart(job, request, active));
  KILN_TRY_STATUS(run_bake(request, [&](const BakeProgress& p) {
                    on_progress(job.id, active, p);
                  }).map([&](const BakeReport& r) {
    active.unmet = r.unmet;
    active.outcome = statement_text(r);
    active.verification = verification_text(r.farm.verification);
    active.units = r.farm.verification.verified + r.farm.verification.unverified;
  }));
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(request.output))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<FileRecord> outputs;
  for (const fs::path& file : files) {
    KILN_TRY(FileRecord record, blobs_->put_file(file, now_ms()));
    record.path = file.filename().string();
    outputs.push_back(std::move(record));
  }
  return outputs;
}

Status ServiceImpl::check_apart(const JobRecord& job, const BakeRequest& request, const Active& active) {
  if (settings_.check_program.empty()) return {};
  // A job that has had a pass was prepared before.
  KILN_TRY(const std::vector<PassRecord> passes, store_->passes(job.id));
  if (!passes.empty()) return {};
  return check_scene_apart(settings_.check_program, request.scene, request.settings, work_folder(job.id),
                           settings_.prepare, active.stop);
}

Expected<std::unique_ptr<FarmJob>> ServiceImpl::open_job(const JobRecord& begun, const JobSpec& spec,
                                                         const ChunkStore& chunks, Active& active) {
  const JobId id = begun.id;
  KILN_TRY_STATUS(persist(
      id,
      [](JobRecord& j) -> Status {
        j.state = JobState::kBaking;
        return {};
      },
      active));
  const auto job = store_->job(id);  // priority and pause may have changed
  if (!job) return fail(ErrorKind::kInternal, text("job {} has gone", id));
  FarmJobSpec open;
  open.spec = spec;
  open.spec.id = id;
  open.chunks = &chunks;
  open.traits = {job->user,   job->name,   job->priority,     job->paused,
                 job->quorum, job->poison, job->numeric_class};
  KILN_TRY(const std::vector<CommitRow> rows, store_->commits(id));
  for (const CommitRow& row : rows)
    open.known.push_back({row.unit, row.shape, row.digest, row.worker, row.settled, row.verified});
  if (!rows.empty()) note(id, text("{} unit results are already stored", rows.size()));
  KILN_TRY(std::unique_ptr<FarmJob> opened, farm_->open_job(open));
  // Apply requests that came between reading the record and now.
  if (active.stop) return fail(ErrorKind::kUnavailable, "the job was stopped");
  if (const auto now = store_->job(id)) farm_->change_job(id, now->priority, now->paused);
  return opened;
}

// The same units as in an earlier run of the job, so that ids match.
Expected<uint32_t> ServiceImpl::cut(JobId job, uint32_t pass, uint32_t chosen) {
  KILN_TRY(const std::vector<PassRecord> passes, store_->passes(job));
  for (const PassRecord& record : passes)
    if (record.pass == pass) return static_cast<uint32_t>(record.cut);
  for (;;) {
    std::promise<Status> stored;
    store_->put_pass(job, {pass, chosen}, [&](Status s) { stored.set_value(std::move(s)); });
    const Status s = stored.get_future().get();
    if (s) return chosen;
    const bool own = s.error().kind == ErrorKind::kInvalidInput || s.error().kind == ErrorKind::kUsage;
    if (own || stopping_) return tl::unexpected<Error>(s.error());
    results_->suspect();
    std::this_thread::sleep_for(kDiskPause);
  }
}

void ServiceImpl::on_progress(JobId id, Active& active, const BakeProgress& p) {
  bool pass_began = false, finishing = false;
  {
    const std::lock_guard lock(mutex_);
    pass_began = p.stage == "bake" && p.pass > active.progress.pass;
    finishing = p.stage != "bake" && active.progress.stage == "bake";
    active.progress = p;
    if (p.stage != "bake") active.progress.pass = 0;
  }
  const uint64_t stored = results_->stored(id);
  const bool new_results = stored > active.progress_at;
  if (finishing) active.finishing = true;
  if (!pass_began && !finishing && !new_results) return;
  const bool first = active.progress_at == 0 && new_results;
  if (!pass_began && !finishing && !first) return;
  active.progress_at = stored;
  // Not retried: if the disk refuses, the next pass writes it.
  store_->change(id, [&](JobRecord& job) -> Status {
    if (p.stage == "bake") {
      job.passes_done = p.pass ? p.pass - 1 : 0;
      job.converged_share = p.converged_share;
    }
    if (new_results) job.preparations = 0;  // the job makes progress
    if (finishing) {
      job.state = JobState::kFinishing;
      job.preparations = std::max(job.preparations, kFinishings);
    }
    return {};
  });
  if (pass_began) note(id, text("pass {}", p.pass));
  if (finishing) note(id, "all passes are done: finishing");
}

// Returns false if the outputs cannot be stored.
bool ServiceImpl::conclude(JobId id, const Active& active, const std::vector<FileRecord>& outputs) {
  for (;;) {
    const Status s = store_->conclude(id, [&](JobRecord& job) -> Status {
      job.state = JobState::kDone;
      job.reason = active.outcome;
      if (!active.unmet.empty()) {  // the masters are worth a day: they can be fetched, with the reason
        job.tainted = true;
        job.taint = active.unmet;
      }
      job.verification = active.verification;
      job.units_done = job.units_total = active.units;
      job.results = outputs;
      job.ended_ms = now_ms();
      return {};
    });
    if (s) return true;
    if (s.error().kind == ErrorKind::kInvalidInput || s.error().kind == ErrorKind::kUsage || stopping_) {
      log_warning(text("job {}: {}", id, s.error().message));
      return false;
    }
    results_->suspect();
    std::this_thread::sleep_for(kDiskPause);
  }
}

void ServiceImpl::finish(JobId id, Active& active, const Expected<std::vector<FileRecord>>& outputs) {
  if (outputs && !active.cancelled) {
    if (conclude(id, active, *outputs)) note(id, "done");
    return;
  }
  const Error error = outputs ? Error{ErrorKind::kUnavailable, ""} : outputs.error();
  // A user's request takes precedence over the coordinator's shutdown; a full disk is not the job's fault.
  const bool cancelled = active.cancelled, stopped = !cancelled && active.stop;
  const bool full = !cancelled && !stopped && error.kind == ErrorKind::kNoSpace;
  // All units are there: what is not wrong with the scene itself may pass.
  const bool again = !cancelled && !stopped && !full && active.finishing &&
                     error.kind != ErrorKind::kInvalidInput && error.kind != ErrorKind::kUsage;
  std::string who;
  {
    const std::lock_guard lock(mutex_);
    who = active.who;
    if (full) not_before_[id] = steady_ms() + kFullDiskPauseMs;
    if (const auto job = store_->job(id); again && job)
      not_before_[id] = steady_ms() + finishing_pause_ms(*job);
  }
  const std::string reason = cancelled ? text("cancelled by {}", who)
                             : stopped ? "the coordinator was stopped in order"
                             : full    ? text("waits for space: {}", error.message)
                             : again   ? text("to finish it failed and is tried again: {}", error.message)
                                       : error.message;
  const Status s = persist(
      id,
      [&](JobRecord& job) -> Status {
        job.state = cancelled                  ? JobState::kCancelled
                    : stopped || full || again ? JobState::kQueued
                                               : JobState::kFailed;
        job.reason = reason.substr(0, 4000);
        std::replace_if(
            job.reason.begin(), job.reason.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
        // This attempt does not count, unless it is the first that came as far as to finish.
        if ((stopped || full) && job.preparations != kFinishings) job.preparations -= job.preparations > 0;
        if (job_ended(job.state)) job.ended_ms = now_ms();
        return {};
      },
      active);
  if (!s) log_warning(text("job {}: {}", id, s.error().message));
  if (cancelled) store_->drop_results(id, {});
  note(id, reason);
}

}  // namespace kiln

// What is deleted for its age, and by which clock; and what is deleted because nothing moves.
#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/backup.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/unix_time.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kMinuteMs = 60'000, kHourMs = 3'600'000, kDayMs = 86'400'000;
constexpr int64_t kIdleMs =
    10 * kMinuteMs;               // an upload without a byte for that long, at most twice, is dropped
constexpr size_t kMaxNamed = 20;  // jobs in a log line

std::string list_of(const std::vector<JobId>& ids) {
  std::string list;
  for (size_t i = 0; i < ids.size() && i < kMaxNamed; ++i) list += text("{}{}", i ? ", " : "", ids[i]);
  return ids.size() > kMaxNamed ? text("{} and {} more", list, ids.size() - kMaxNamed) : list;
}

}  // namespace

int64_t ServiceImpl::wall_ms() const {
  return settings_.wall_clock ? settings_.wall_clock() : unix_ms();
}

int64_t ServiceImpl::steady_ms() const {
  return settings_.steady_clock ? settings_.steady_clock() : SteadyClock().now_ms();
}

// A clock that was set back must not make today's jobs old.
int64_t ServiceImpl::now_ms() const {
  const std::lock_guard lock(time_mutex_);
  return std::max(wall_ms(), time_.now_ms());
}

std::string ServiceImpl::clock_doubt() const {
  const std::lock_guard lock(time_mutex_);
  if (!time_.doubted()) return "";
  return text(
      "the clock reads {}, more than a day beyond {}, when this coordinator saw it last or ran: nothing is "
      "deleted for its age until it has gone on evenly for a day, or `kiln doctor --data {} "
      "--accept-clock` says that it is right",
      utc_text(time_.record().claimed_ms), utc_text(time_.now_ms()),
      fs::absolute(settings_.data).lexically_normal().string());
}

void ServiceImpl::start_clock() {
  int64_t newest = 0;
  for (const JobRecord& job : store_->jobs())
    newest = std::max({newest, job.submitted_ms, job.started_ms, job.ended_ms});
  const int64_t steady = steady_ms();
  {
    const std::lock_guard lock(time_mutex_);
    time_ = ObservedTime(read_clock(settings_.data), newest, wall_ms(), steady);
  }
  growth_ = read_growth(settings_.data);
  next_collection_ = steady + kHourMs;
  next_idle_look_ = steady + kIdleMs;
  observe_time();
  measure_data();
  next_measure_ = steady + kMinuteMs;
}

void ServiceImpl::tend() {
  observe_time();
  obey_backup_request();
  const int64_t now = steady_ms();
  if (now >= next_collection_) {
    if (const std::string doubt = clock_doubt(); !doubt.empty()) log_warning(doubt);
    collect();
    next_collection_ = now + kHourMs;
  }
  if (now >= next_measure_) {
    measure_data();
    next_measure_ = now + kMinuteMs;
  }
  if (now >= next_idle_look_) {
    blobs_->drop_idle();
    next_idle_look_ = now + kIdleMs;
  }
}

void ServiceImpl::observe_time() {
  const int64_t steady = steady_ms(), wall = wall_ms();
  {
    const std::lock_guard lock(time_mutex_);
    time_.observe(wall, steady);
  }
  obey_acceptance(wall);
  const std::string doubt = clock_doubt();
  if (doubt.empty() == doubted_) {
    log_warning(doubt.empty() ? text("the clock, {}, is believed again", utc_text(wall)) : doubt);
    note(0, doubt.empty() ? "the clock is believed again" : doubt);
    doubted_ = !doubt.empty();
    next_clock_ = steady;
  }
  if (steady < next_clock_) return;
  next_clock_ = steady + kMinuteMs;
  // If the disk refuses, less time counts as seen at the next start: things are kept for longer.
  const std::lock_guard lock(time_mutex_);
  if (const Status written = write_clock(settings_.data, time_.record()); !written)
    log_info(written.error().message);
}

// The doctor's word, which also reaches a coordinator that runs.
void ServiceImpl::obey_acceptance(int64_t wall) {
  const auto accepted = take_acceptance(settings_.data);
  if (!accepted) return;
  const bool same = *accepted <= wall + kDayMs && wall <= *accepted + kDayMs;
  log_warning(same ? text("the clock, {}, was accepted by hand", utc_text(wall))
                   : text("the clock was accepted at {}, and reads {} now: accept it again",
                          utc_text(*accepted), utc_text(wall)));
  const std::lock_guard lock(time_mutex_);
  if (same) time_.accept();
}

// On a thread of its own, because it may copy for long while jobs go on.
void ServiceImpl::obey_backup_request() {
  if (backing_up_) return;
  const auto folder = take_backup_request(settings_.data);
  if (!folder) return;
  if (backup_.joinable()) backup_.join();
  backing_up_ = true;
  backup_ = std::thread([this, folder = *folder] {
    const auto made = back_up(*store_, *blobs_, folder, [this] { return !stopping_; });
    if (made)
      if (const Status noted = note_backup(settings_.data, now_ms(), *made); !noted)
        log_warning(noted.error().message);
    const std::string said = made
                                 ? text("a backup of {} jobs and {} files was made in {}", made->jobs,
                                        made->files, folder.string())
                                 : text("the backup in {} failed: {}", folder.string(), made.error().message);
    made ? log_info(said) : log_warning(said);
    note(0, said);
    if (const Status told = answer_backup(settings_.data, made); !told) log_warning(told.error().message);
    backing_up_ = false;
  });
}

// Jobs that ended while the clock was wrong would never grow old.
void ServiceImpl::date_ends_anew(int64_t now) {
  for (const JobRecord& job : store_->jobs()) {
    if (!job_ended(job.state) || job.ended_ms <= now + kDayMs) continue;
    const Status s = store_->change(job.id, [&](JobRecord& record) -> Status {
      record.ended_ms = now;
      return {};
    });
    if (!s) return log_warning(s.error().message);
    note(job.id, text("the clock was wrong when it ended, at {}: its age counts from {}",
                      utc_text(job.ended_ms), utc_text(now)));
  }
}

void ServiceImpl::collect() {
  if (!held_for().empty()) return;
  if (!clock_doubt().empty()) return;
  int64_t now = 0;
  {
    const std::lock_guard lock(time_mutex_);
    now = time_.now_ms();
  }
  date_ends_anew(now);
  const auto forgotten = store_->forget_ended(now - int64_t{settings_.keep_days} * kDayMs);
  if (!forgotten) return log_warning(forgotten.error().message);
  for (const JobId id : *forgotten)
    note(0, text("job {} ended {} days ago and is forgotten", id, settings_.keep_days));
  // At every level: results that people may look for are deleted here.
  if (!forgotten->empty())
    log_warning(text("ended jobs forgotten, with their results: {}, more than {} days old at {} (job {})",
                     forgotten->size(), settings_.keep_days, utc_text(now), list_of(*forgotten)));
  // An uploaded file must be submitted within a day.
  blobs_->collect(referenced_blobs(store_->jobs()), now, kDayMs);
}

}  // namespace kiln

// What the farm says of itself: to clients, on its pages, in its metrics.
#include <sys/statvfs.h>

#include <numeric>

#include "common/base/log.h"
#include "common/wire/tls.h"
#include "coordinator/farm/queue/backup.h"
#include "coordinator/service/service_impl.h"

namespace kiln {
namespace {

constexpr int64_t kDayMs = 86'400'000;

}  // namespace

FarmSource ServiceImpl::source() {
  FarmSource source;
  source.farm = [this] { return farm_->status(); };
  source.jobs = [this] { return store_->jobs(); };
  source.job = [this](JobId id) { return store_->job(id); };
  source.events = [this](JobId id) { return events_of(id); };
  source.progress = [this](JobId id) -> std::optional<JobProgress> {
    const auto progress = progress_of(id);
    if (!progress) return std::nullopt;
    return JobProgress{progress->stage, progress->pass, progress->seconds_left};
  };
  source.workers = [this] { return store_->workers(); };
  source.health = [this] { return health(); };
  return source;
}

FarmHealth ServiceImpl::health() {
  const BlobStore::Verified verified = blobs_->verified();
  FarmHealth health;
  health.release = settings_.release;
  health.epoch = store_->epoch();
  health.now_ms = now_ms();
  health.held_for = held_for();
  health.clock_doubt = clock_doubt();
  health.wal_bytes = store_->wal_size();
  health.verified_bytes = verified.bytes;
  health.damaged_blobs = verified.damaged;
  health.damaged_results = damaged_results_;
  if (const auto& tls = settings_.farm.tls) {
    const RevocationLists::Extent revoked = tls->revocations();
    health.tls = true;
    health.certificate_until = settings_.certificate_until;
    health.revoked_lists = revoked.files;
    health.revoked_serials = revoked.serials;
  }
  const std::lock_guard lock(data_mutex_);
  health.data = data_;
  return health;
}

void ServiceImpl::measure_data() {
  int64_t now = 0;
  {
    const std::lock_guard lock(time_mutex_);
    now = time_.now_ms();
  }
  const std::vector<JobRecord> jobs = store_->jobs();
  DataReport data;
  data.sizes = measure_data_folder(settings_.data, jobs);
  // If the disk refuses, the sample is kept in memory, and the next one is written with it.
  if (growth_.add(now, data.sizes))
    if (const Status written = write_growth(settings_.data, growth_); !written)
      log_info(written.error().message);
  data.bytes_a_day = growth_.a_day(now, data.sizes);
  struct statvfs disk {};
  if (::statvfs(settings_.data.c_str(), &disk) == 0) {
    data.disk_bytes = uint64_t{disk.f_blocks} * disk.f_frsize;
    data.free_bytes = uint64_t{disk.f_bavail} * disk.f_frsize;
  }
  if (data.bytes_a_day)
    data.days_until_full = days_until_full(
        data.free_bytes, std::accumulate(data.bytes_a_day->begin(), data.bytes_a_day->end(), 0.0));
  data.keep_days = settings_.keep_days;
  data.next = next_deletion(jobs, int64_t{settings_.keep_days} * kDayMs);
  const BackupNote backup = read_backup_note(settings_.data);
  data.backup_ms = backup.at_ms;
  data.backup_bytes = backup.made.bytes;
  data.backup_jobs = backup.made.jobs;
  const std::lock_guard lock(data_mutex_);
  data_ = std::move(data);
}

}  // namespace kiln

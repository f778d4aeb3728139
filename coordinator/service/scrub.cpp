// Reads all that is stored once a week, slowly, so that rot is found before somebody needs the bytes.
#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/service_impl.h"

namespace kiln {
namespace {

constexpr int64_t kRoundMs = int64_t{7} * 86'400'000;
constexpr auto kLook = std::chrono::minutes(1);

}  // namespace

void ServiceImpl::scrub() {
  // False once the service stops.
  const auto rest = [this](std::chrono::nanoseconds time) {
    std::unique_lock lock(mutex_);
    return !changed_.wait_for(lock, time, [this] { return stopping_.load(); });
  };
  const ReadPace pace = [&](uint64_t bytes) {
    return rest(std::chrono::nanoseconds(bytes * 1'000'000'000 / (uint64_t{settings_.scrub_mib_s} << 20)));
  };
  while (!stopping_) {
    const int64_t begun = steady_ms();
    scrub_blobs(pace);
    scrub_spool(pace);
    while (!stopping_ && steady_ms() - begun < kRoundMs) rest(kLook);
  }
}

void ServiceImpl::scrub_blobs(const ReadPace& pace) {
  const std::set<Digest> referenced = referenced_blobs(store_->jobs());
  std::vector<Digest> digests(referenced.begin(), referenced.end());
  // Each start begins elsewhere, so that a coordinator that is started often reads all in the end.
  const Digest first = sha256(bytes_of(text("{}", store_->epoch())));
  std::rotate(digests.begin(), std::lower_bound(digests.begin(), digests.end(), first), digests.end());
  for (const Digest& digest : digests) {
    if (stopping_) return;
    const auto state = blobs_->verify(digest, pace);
    if (state && *state == BlobState::kIntact) continue;
    if (!state && stopping_) return;
    if (!state) {
      log_warning(state.error().message);
      continue;
    }
    tell_of_damaged_input(digest);
    if (const auto again = bake_again(digest, 0); !again) log_warning(again.error().message);
  }
}

void ServiceImpl::tell_of_damaged_input(const Digest& lost) {
  for (const JobRecord& job : store_->jobs()) {
    const auto file = std::find_if(job.inputs.begin(), job.inputs.end(),
                                   [&](const FileRecord& input) { return input.digest == lost; });
    if (file == job.inputs.end() || job_ended(job.state)) continue;
    const std::string what = text(
        "its input {} (blob {}) is damaged on the coordinator's disk, or gone from it: submit the scene "
        "again, "
        "which sends the file anew",
        file->path, lost.hex());
    log_warning(text("job {}: {}", job.id, what));
    note(job.id, what);
  }
}

// Damaged records are baked again when their job reads them; here they are a word about the disk.
void ServiceImpl::scrub_spool(const ReadPace& pace) {
  for (const JobRecord& job : store_->jobs()) {
    const auto rows = store_->commits(job.id);
    if (!rows) continue;
    for (const CommitRow& row : *rows) {
      if (!pace(row.length)) return;
      // Looked up again each time: results come and go while this reads.
      auto record = store_->read_result(row.job, row.unit, row.digest);
      if (!record) record = store_->read_result(row.job, row.unit, row.digest);
      if (record || record.error().kind != ErrorKind::kIo) continue;
      ++damaged_results_;
      log_warning(record.error().message);
    }
  }
}

}  // namespace kiln

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/blob_files.h"
#include "coordinator/farm/queue/blobs.h"

namespace kiln {
namespace fs = std::filesystem;

void BlobStore::collect_damaged(int64_t now_ms) {
  constexpr int64_t kMonthMs = int64_t{30} * 86'400'000;  // for whoever looks into the disk's failure
  for (const fs::path& file : list_folder(folder_ / kDamagedFolder)) {
    const auto used = last_use(file);
    std::error_code ignored;
    if (used && now_ms - *used > kMonthMs) fs::remove(file, ignored);
  }
}

BlobStore::Collected BlobStore::collect(const std::set<Digest>& referenced, int64_t now_ms, int64_t keep_ms) {
  Collected collected;
  collect_damaged(now_ms);
  for (const fs::path& folder : list_folder(folder_)) {
    if (folder.filename() == kDamagedFolder) continue;
    for (const fs::path& file : list_folder(folder)) {
      const bool part = file.extension() == kPartEnding;
      const auto digest = Digest::from_hex((part ? file.stem() : file.filename()).string());
      if (!digest) continue;  // not ours
      // Nobody may start using it between the check and the removal.
      const std::lock_guard lock(mutex_);
      const auto used = last_use(file);
      std::error_code code;
      const uint64_t size = fs::file_size(file, code);
      if (code || !used) continue;
      const bool needed = (!part && referenced.count(*digest)) || uploads_.count(*digest);
      if (needed || now_ms - *used <= keep_ms || !fs::remove(file, code) || code) {
        ++collected.kept;
        continue;
      }
      ++collected.blobs;
      collected.bytes += size;
    }
  }
  if (collected.blobs)
    log_info(text("{} blobs that no job needs were removed, {} MiB; {} are kept", collected.blobs,
                  collected.bytes >> 20, collected.kept));
  return collected;
}

std::set<Digest> referenced_blobs(const std::vector<JobRecord>& jobs) {
  std::set<Digest> digests;
  for (const JobRecord& job : jobs) {
    for (const FileRecord& file : job.inputs) digests.insert(file.digest);
    for (const FileRecord& file : job.results) digests.insert(file.digest);
  }
  return digests;
}

}  // namespace kiln

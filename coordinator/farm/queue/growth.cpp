#include "coordinator/farm/queue/growth.h"

#include <algorithm>
#include <map>
#include <set>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/open_file.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFile = "growth";
constexpr uint64_t kMaxFile = uint64_t{1} << 20;
constexpr size_t kMaxSamples = 1024;
constexpr int64_t kDayMs = 86'400'000;

uint64_t size_of(const fs::path& file) {
  std::error_code code;
  const uint64_t size = fs::file_size(file, code);
  return code ? 0 : size;
}

// A whole number below 2^60, or nothing.
std::optional<uint64_t> whole(const JsonValue& object, const char* name) {
  const JsonValue* member = object.find(name);
  if (!member || !member->is_whole || member->negative || member->whole >= uint64_t{1} << 60)
    return std::nullopt;
  return member->whole;
}

std::optional<GrowthHistory> parse_history(std::string_view document) {
  const auto json = parse_json(document);
  const JsonValue* samples = json ? json->find("samples") : nullptr;
  if (!samples || samples->kind != JsonValue::Kind::kList || samples->items.size() > kMaxSamples)
    return std::nullopt;
  GrowthHistory history;
  for (const JsonValue& item : samples->items) {
    const auto at_ms = whole(item, "at_ms");
    if (!at_ms) return std::nullopt;
    DataSizes sizes;
    for (const DataKind& kind : kDataKinds) {
      const auto bytes = whole(item, kind.name);
      if (!bytes) return std::nullopt;
      sizes.*kind.bytes = *bytes;
    }
    if (!history.add(static_cast<int64_t>(*at_ms), sizes)) return std::nullopt;
  }
  return history;
}

}  // namespace

DataSizes measure_data_folder(const fs::path& data, const std::vector<JobRecord>& jobs) {
  DataSizes sizes;
  std::set<Digest> seen;
  for (const auto& [files, bytes] :
       {std::pair{&JobRecord::inputs, &DataSizes::inputs}, {&JobRecord::results, &DataSizes::published}})
    for (const JobRecord& job : jobs)
      for (const FileRecord& file : job.*files)
        if (seen.insert(file.digest).second) sizes.*bytes += file.size;
  for (const fs::path& job : list_folder(data / "spool"))
    for (const fs::path& file : list_folder(job)) sizes.spool += size_of(file);
  sizes.database = size_of(data / "kiln.db") + size_of(data / "kiln.db-wal");
  for (const fs::path& file : list_folder(data / "blobs" / "damaged")) sizes.damaged += size_of(file);
  return sizes;
}

bool GrowthHistory::add(int64_t at_ms, const DataSizes& sizes) {
  if (!samples_.empty() && at_ms < samples_.back().at_ms + kEveryMs) return false;
  std::erase_if(samples_, [&](const Sample& s) { return s.at_ms < at_ms - kKeepMs; });
  samples_.push_back({at_ms, sizes});
  return true;
}

std::optional<std::array<double, kDataKinds.size()>> GrowthHistory::a_day(int64_t now_ms,
                                                                          const DataSizes& now) const {
  if (samples_.empty() || now_ms < samples_.front().at_ms + kEveryMs) return std::nullopt;
  const double days = static_cast<double>(now_ms - samples_.front().at_ms) / kDayMs;
  KILN_CHECK(days > 0);
  std::array<double, kDataKinds.size()> growth{};
  for (size_t k = 0; k < kDataKinds.size(); ++k)
    growth[k] = (static_cast<double>(now.*kDataKinds[k].bytes) -
                 static_cast<double>(samples_.front().sizes.*kDataKinds[k].bytes)) /
                days;
  return growth;
}

GrowthHistory read_growth(const fs::path& data) {
  std::error_code code;
  if (!fs::exists(data / kFile, code)) return {};
  const auto bytes = read_file(data / kFile, kMaxFile);
  if (bytes)
    if (auto history = parse_history({reinterpret_cast<const char*>(bytes->data()), bytes->size()}))
      return *history;
  log_warning(text("{} is damaged: growth is measured anew", (data / kFile).string()));
  return {};
}

Status write_growth(const fs::path& data, const GrowthHistory& history) {
  JsonWriter w;
  w.begin_object().key("samples").begin_array();
  for (const GrowthHistory::Sample& sample : history.samples()) {
    w.begin_object().pair("at_ms", sample.at_ms);
    for (const DataKind& kind : kDataKinds) w.pair(kind.name, sample.sizes.*kind.bytes);
    w.end_object();
  }
  return write_file_atomic(data / kFile, w.end_array().end_object().take());
}

NextDeletion next_deletion(const std::vector<JobRecord>& jobs, int64_t keep_ms) {
  std::set<JobId> awaited;
  for (const JobRecord& job : jobs)
    if (!job_ended(job.state)) awaited.insert(job.after.begin(), job.after.end());
  const auto grows_old = [&](const JobRecord& job) { return job_ended(job.state) && !awaited.count(job.id); };
  NextDeletion next;
  for (const JobRecord& job : jobs)
    if (grows_old(job) && (!next.at_ms || job.ended_ms + keep_ms < next.at_ms))
      next.at_ms = job.ended_ms + keep_ms;
  std::map<Digest, uint64_t> theirs;
  std::set<Digest> others;
  for (const JobRecord& job : jobs) {
    const bool goes = grows_old(job) && job.ended_ms + keep_ms < next.at_ms + kDayMs;
    if (goes) next.jobs.push_back(job.id);
    for (const auto* files : {&job.inputs, &job.results})
      for (const FileRecord& file : *files) {
        if (goes)
          theirs.emplace(file.digest, file.size);
        else
          others.insert(file.digest);
      }
  }
  for (const auto& [digest, size] : theirs)
    if (!others.count(digest)) next.bytes += size;
  return next;
}

std::optional<double> days_until_full(uint64_t free_bytes, double bytes_a_day) {
  if (!(bytes_a_day > 0)) return std::nullopt;
  return static_cast<double>(free_bytes) / bytes_a_day;
}

}  // namespace kiln

#include "coordinator/farm/queue/records.h"

#include <algorithm>
#include <array>
#include <set>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMaxName = 256, kMaxSentence = 4096, kMaxPath = 4096, kMaxSettings = size_t{1} << 20;
constexpr size_t kMaxFiles = 100000, kMaxAfter = 1024;

bool has_control(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; });
}

Status wrong(std::string message) {
  return fail(ErrorKind::kInvalidInput, std::move(message));
}

Status check_text(std::string_view field, std::string_view value, size_t most) {
  if (value.size() > most)
    return wrong(text("the {} of a job has {} bytes: {} are allowed", field, value.size(), most));
  if (has_control(value)) return wrong(text("the {} of a job has a control character", field));
  return {};
}

bool stays_inside(std::string_view path) {
  if (path.empty() || path.size() > kMaxPath || path.front() == '/' || has_control(path)) return false;
  for (size_t at = 0; at <= path.size();) {
    const size_t end = std::min(path.find('/', at), path.size());
    const std::string_view part = path.substr(at, end - at);
    if (part.empty() || part == "." || part == "..") return false;
    at = end + 1;
  }
  return true;
}

}  // namespace

std::string_view job_state_name(JobState state) {
  static constexpr std::array<std::string_view, 8> kNames{"waiting",   "queued", "preparing", "baking",
                                                          "finishing", "done",   "failed",    "cancelled"};
  return kNames.at(static_cast<size_t>(state));
}

bool job_ended(JobState state) {
  return state == JobState::kDone || state == JobState::kFailed || state == JobState::kCancelled;
}

Status check_files(std::string_view field, const std::vector<FileRecord>& files) {
  if (files.size() > kMaxFiles)
    return wrong(text("a job with {} {} files: {} are allowed", files.size(), field, kMaxFiles));
  std::set<std::string_view> seen;
  for (const FileRecord& file : files) {
    if (!stays_inside(file.path))
      return wrong(
          text("the {} file '{}' of a job: a relative path without . and .. is needed", field, file.path));
    if (!seen.insert(file.path).second)
      return wrong(text("the {} file '{}' of a job is listed twice", field, file.path));
  }
  return {};
}

std::string suspect_words(const std::string& worker) {
  return text("units are {}'s alone, which was quarantined: ", worker);
}

bool JobRecord::result_is_suspect(const std::string& worker) const {
  if (state != JobState::kDone || !tainted) return false;
  return taint.find(worker.empty() ? std::string("'s alone, which was quarantined: ")
                                   : suspect_words(worker)) != std::string::npos;
}

Status check_job(const JobRecord& job) {
  KILN_TRY_STATUS(check_text("name", job.name, kMaxName));
  KILN_TRY_STATUS(check_text("user", job.user, kMaxName));
  KILN_TRY_STATUS(check_text("reason", job.reason, kMaxSentence));
  KILN_TRY_STATUS(check_text("taint", job.taint, kMaxSentence));
  KILN_TRY_STATUS(check_text("verification", job.verification, kMaxSentence));
  KILN_TRY_STATUS(check_text("submission", job.submission, kMaxName));
  KILN_TRY_STATUS(check_text("numeric class", job.numeric_class, kMaxName));
  if (job.settings.size() > kMaxSettings)
    return wrong(
        text("the settings of a job have {} bytes: {} are allowed", job.settings.size(), kMaxSettings));
  if (job.priority < -100 || job.priority > 100)
    return wrong(text("priority {}: -100 to 100 is allowed", job.priority));
  if (job.quorum < 1 || job.quorum > 16) return wrong(text("quorum {}: 1 to 16 is allowed", job.quorum));
  if (job.state > JobState::kCancelled || job.poison > PoisonPolicy::kSkip)
    return wrong("a job has a state or a policy that does not exist");
  if (job.after.size() > kMaxAfter)
    return wrong(text("a job waits for {} others: {} are allowed", job.after.size(), kMaxAfter));
  KILN_TRY_STATUS(check_files("input", job.inputs));
  KILN_TRY_STATUS(check_files("result", job.results));
  const bool known = std::any_of(job.inputs.begin(), job.inputs.end(),
                                 [&](const FileRecord& file) { return file.path == job.scene; });
  if (!known && !(job.scene.empty() && job.inputs.empty()))
    return wrong(text("the scene '{}' of a job is not among its input files", job.scene));
  return {};
}

}  // namespace kiln

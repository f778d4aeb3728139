#include <ctime>
#include <limits>

#include "common/base/format.h"
#include "coordinator/farm/documents/farm_documents.h"
#include "coordinator/service/fields.h"
#include "coordinator/service/job_settings.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/verbs.h"

namespace kiln {
namespace {

constexpr int64_t kMaxId = int64_t{1} << 62, kMaxSize = int64_t{1} << 40;
constexpr size_t kMaxInputs = 20000;  // so that the manifest fits a request
constexpr size_t kMaxText = 256, kMaxPath = 4096;

Expected<std::vector<FileRecord>> read_inputs(const JsonValue& document) {
  const JsonValue* list = document.find("inputs");
  if (!list || list->kind != JsonValue::Kind::kList)
    return fail(ErrorKind::kInvalidInput, "'inputs' must be a list of files");
  if (list->items.empty() || list->items.size() > kMaxInputs)
    return fail(ErrorKind::kInvalidInput,
                text("'inputs' has {} files: 1 to {} are allowed", list->items.size(), kMaxInputs));
  std::vector<FileRecord> files;
  for (const JsonValue& item : list->items) {
    if (const Status s = only_fields(item, {"path", "digest", "size"}); !s)
      return fail(ErrorKind::kInvalidInput, "'inputs': " + s.error().message);
    FileRecord file;
    KILN_TRY(file.path, text_field(item, "path", kMaxPath));
    KILN_TRY(file.digest, digest_field(item, "digest"));
    KILN_TRY(const int64_t size, number_field(item, "size", 0, kMaxSize));
    file.size = static_cast<uint64_t>(size);
    files.push_back(std::move(file));
  }
  return files;
}

// The settings as given, once parsed successfully.
Expected<std::string> read_settings(const JsonValue& document, const std::vector<FileRecord>& inputs) {
  KILN_TRY(std::string settings, text_field(document, "settings", size_t{1} << 20, "{}"));
  KILN_TRY_STATUS(read_job_settings(settings, inputs).map([](const auto&) {}));
  return settings;
}

Expected<JobRecord> read_submission(const Ask& ask) {
  const JsonValue& d = ask.document;
  KILN_TRY_STATUS(only_fields(
      d, {"key", "name", "priority", "after", "quorum", "on_poison", "settings", "scene", "inputs"}));
  JobRecord job;
  job.user = ask.caller.user;
  KILN_TRY(job.submission, text_field(d, "key", kMaxText));
  if (job.submission.empty()) return fail(ErrorKind::kInvalidInput, "'key' is empty");
  KILN_TRY(job.scene, text_field(d, "scene", kMaxPath));
  KILN_TRY(job.name, text_field(d, "name", kMaxText, job.scene.substr(0, kMaxText)));
  KILN_TRY(const int64_t priority, number_field(d, "priority", -100, 100, 0));
  job.priority = static_cast<int32_t>(priority);
  KILN_TRY(job.after, ids_field(d, "after", 1024));
  KILN_TRY(const int64_t quorum, number_field(d, "quorum", 1, 16, 1));
  job.quorum = static_cast<uint32_t>(quorum);
  KILN_TRY(const std::string poison, text_field(d, "on_poison", 8, std::string("fail")));
  const bool skip = poison.compare("skip") == 0;
  if (!skip && poison.compare("fail") != 0)
    return fail(ErrorKind::kInvalidInput, "'on_poison' must be \"fail\" or \"skip\"");
  job.poison = skip ? PoisonPolicy::kSkip : PoisonPolicy::kFail;
  KILN_TRY(job.inputs, read_inputs(d));
  KILN_TRY(job.settings, read_settings(d, job.inputs));
  job.state = job.after.empty() ? JobState::kQueued : JobState::kWaiting;
  job.submitted_ms = ask.service.now_ms();
  KILN_TRY_STATUS(check_job(job));
  return job;
}

// Finds the inputs that the store does not have, or whose blobs rotted: those are set aside here, so that the
// same submission sends them again.
class InputCheck {
 public:
  InputCheck(BlobStore& blobs, int64_t now_ms) : blobs_(blobs), now_ms_(now_ms) {}
  Expected<bool> has(const FileRecord& file) {
    if (!blobs_.use(file.digest, now_ms_)) return false;
    KILN_TRY(const uint64_t size, blobs_.size(file.digest));
    // What is not read here is when it is laid out for the bake.
    const bool trusted = size == file.size && (read_.count(file.digest) || bytes_ + size > kMaxBytes);
    if (trusted) return true;
    bytes_ += size;
    KILN_TRY(const BlobState state, blobs_.verify(file.digest));
    if (state != BlobState::kIntact) return false;
    read_.insert(file.digest);
    if (size == file.size) return true;
    return fail(ErrorKind::kInvalidInput,
                text("'inputs': {} has {} bytes, not {}", file.path, size, file.size));
  }

 private:
  static constexpr uint64_t kMaxBytes = uint64_t{4} << 30;  // so that an answer comes in seconds
  BlobStore& blobs_;
  const int64_t now_ms_;
  std::set<Digest> read_;
  uint64_t bytes_ = 0;
};

}  // namespace

// {"missing": [digest...]}: send these, then ask again with the same key; or {"id": N}: the job is durable.
Expected<std::string> verb_submit(const Ask& ask) {
  KILN_TRY(const JobRecord job, read_submission(ask));
  JsonWriter w;
  w.begin_object().key("missing").begin_array();
  std::set<Digest> missing;
  InputCheck inputs(ask.service.blobs(), job.submitted_ms);
  for (const FileRecord& file : job.inputs) {
    KILN_TRY(const bool there, inputs.has(file));
    if (!there && missing.insert(file.digest).second) w.value(file.digest.hex());
  }
  w.end_array();
  if (!missing.empty()) return w.end_object().take();
  KILN_TRY(const JobId id, ask.service.store().submit(job));
  const auto stored = ask.service.store().job(id);
  if (stored && stored->submitted_ms == job.submitted_ms)
    ask.service.note(id, text("submitted by {}", job.user));
  ask.service.wake();
  w.pair("id", id);
  if (job.quorum > 1 && !ask.service.farm().status().owners_known)
    w.pair("note",
           text("a quorum of {} means as many machines here, not owners: all workers share one token; "
                "certificates, or lines NAME TOKEN in the file of worker tokens, tell owners apart",
                job.quorum));
  return w.end_object().take();
}

Expected<std::string> verb_jobs(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"before", "most"}));
  KILN_TRY(const int64_t before, number_field(ask.document, "before", 0, kMaxId, 0));
  KILN_TRY(const int64_t most, number_field(ask.document, "most", 1, 1000, 200));
  return jobs_document(ask.service.source(), {static_cast<JobId>(before), static_cast<size_t>(most)});
}

Expected<std::string> verb_job(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id"}));
  KILN_TRY(const int64_t id, number_field(ask.document, "id", 1, kMaxId));
  if (auto document = job_document(ask.service.source(), static_cast<JobId>(id))) return *std::move(document);
  return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
}

}  // namespace kiln

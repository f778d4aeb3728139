#include <algorithm>

#include "common/base/format.h"
#include "coordinator/service/client_files.h"
#include "coordinator/service/fields.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/verbs.h"

namespace kiln {
namespace {

constexpr int64_t kMaxId = int64_t{1} << 62, kMaxSize = int64_t{1} << 40;

}  // namespace

// {"offset": N}: send from there on. Called while pieces are sent, it reports how many bytes are on
// disk, or why they are not.
Expected<std::string> verb_upload(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"digest", "size"}));
  KILN_TRY(const Digest digest, digest_field(ask.document, "digest"));
  KILN_TRY(const int64_t size, number_field(ask.document, "size", 0, kMaxSize));
  KILN_TRY(const uint64_t offset, ask.files.begin_upload(digest, static_cast<uint64_t>(size)));
  return JsonWriter().begin_object().pair("offset", offset).end_object().take();
}

// Everything is sent: check the digest.
Expected<std::string> verb_uploaded(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"digest"}));
  KILN_TRY(const Digest digest, digest_field(ask.document, "digest"));
  KILN_TRY_STATUS(ask.files.finish_upload(digest, ask.service.now_ms()));
  return JsonWriter().begin_object().pair("digest", digest.hex()).end_object().take();
}

// {"id"}: the files of the results. With "path" and "from": a ChunkRequest for the file's digest
// may follow and is answered with its bytes from that offset.
Expected<std::string> verb_fetch(const Ask& ask) {
  KILN_TRY_STATUS(only_fields(ask.document, {"id", "path", "from"}));
  KILN_TRY(const int64_t id, number_field(ask.document, "id", 1, kMaxId));
  KILN_TRY(const std::string path, text_field(ask.document, "path", 4096, ""));
  KILN_TRY(const int64_t from, number_field(ask.document, "from", 0, kMaxSize, 0));
  const auto job = ask.service.store().job(static_cast<JobId>(id));
  if (!job) return fail(ErrorKind::kInvalidInput, text("there is no job {}", id));
  if (job->state != JobState::kDone)
    return fail(ErrorKind::kUnavailable,
                text("job {} is {}: it has no results{}{}", id, job_state_name(job->state),
                     job->reason.empty() ? "" : ": ", job->reason));
  JsonWriter w;
  w.begin_object().pair("tainted", job->tainted).pair("taint", job->taint);
  w.pair("verification", job->verification).key("files").begin_array();
  bool found = path.empty();
  for (const FileRecord& file : job->results) {
    if (!path.empty() && file.path != path) continue;
    found = true;
    if (!path.empty()) {
      if (static_cast<uint64_t>(from) > file.size)
        return fail(ErrorKind::kInvalidInput, text("'from': {} has {} bytes", path, file.size));
      KILN_TRY_STATUS(ask.service.check_result(job->id, file));
      KILN_TRY_STATUS(ask.files.allow_download(file.digest, static_cast<uint64_t>(from)));
    }
    w.begin_object()
        .pair("path", file.path)
        .pair("digest", file.digest.hex())
        .pair("size", file.size)
        .end_object();
  }
  if (!found) return fail(ErrorKind::kInvalidInput, text("job {} has no result '{}'", id, path));
  return w.end_array().end_object().take();
}

}  // namespace kiln

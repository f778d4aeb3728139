// The store's records, as plain data. Times are Unix milliseconds for display only: the farm uses them for
// nothing but the age at which ended jobs are forgotten.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/hash.h"
#include "common/base/status.h"
#include "coordinator/farm/ledger/rules.h"

namespace kiln {

inline constexpr uint32_t kMaxPayloadBytes = uint32_t{64} << 20;  // of one result

// In the order of a job's life. The numbers are stored.
enum class JobState : uint8_t {
  kWaiting = 0,    // for other jobs (`after`)
  kQueued = 1,     // may begin
  kPreparing = 2,  // import, layout, plan
  kBaking = 3,
  kFinishing = 4,  // post, encode, report
  kDone = 5,
  kFailed = 6,
  kCancelled = 7,
};
std::string_view job_state_name(JobState state);  // "waiting", "queued", ...
bool job_ended(JobState state);                   // done, failed or cancelled

// A file of a job, by content.
struct FileRecord {
  std::string path;  // relative, with '/'
  Digest digest;     // SHA-256 of its bytes
  uint64_t size = 0;
  bool operator==(const FileRecord&) const = default;
};

struct JobRecord {
  JobId id = 0;  // given by submit()
  std::string name, user;
  int32_t priority = 0;  // -100 to 100; higher first
  JobState state = JobState::kQueued;
  bool paused = false;
  std::string reason;        // why it is in that state: one sentence
  std::vector<JobId> after;  // jobs that must be done first
  uint32_t quorum = 1;       // workers that must agree on a unit
  PoisonPolicy poison = PoisonPolicy::kFail;
  std::string settings;  // flat JSON (common/base/json.h)
  std::string
      submission;  // random key from the submitter: the same key again means the same job, not another
  std::string numeric_class;       // of its results; empty: none yet
  std::vector<FileRecord> inputs;  // blobs
  std::string scene;               // the glTF among them
  uint32_t preparations = 0;       // times a conductor started it: bounds a job that crashes its conductor
  int64_t submitted_ms = 0, started_ms = 0, ended_ms = 0;  // 0: not yet
  uint32_t passes_done = 0;
  uint64_t units_done = 0, units_total = 0, texels = 0;  // stored and served, never set
  double worst_relative_error = 0;                       // never set
  double converged_share = 0;                            // of the texels, 0 to 1
  std::vector<FileRecord> results;
  bool tainted = false;      // part of the result is unproved
  std::string taint;         // which part: one sentence
  std::string verification;  // how its results were checked (verification_text)
  bool operator==(const JobRecord&) const = default;
  // Published with results that nobody but this worker gave, which was quarantined; empty: any worker.
  bool result_is_suspect(const std::string& worker) const;
};

// The sentence of `taint` about such results, which begins with their number.
std::string suspect_words(const std::string& worker);

// Fails (kInvalidInput, naming the field) on values the store refuses: priority, quorum, sizes, paths that
// leave their folder, a scene that is not among the inputs.
Status check_job(const JobRecord& job);

// The same for a list of files from outside; `field` names it.
Status check_files(std::string_view field, const std::vector<FileRecord>& files);

struct JobEvent {
  int64_t at_ms = 0;
  std::string text;  // one sentence
};

// A unit's result, to be made durable.
struct UnitCommit {
  JobId job = 0;
  uint64_t unit = 0;      // of the job
  uint64_t shape = 0;     // unit_shape(): identifies results of units that were cut differently
  Digest digest;          // result_digest()
  std::string worker;     // identity of its worker
  bool verified = false;  // a second worker gave the same
};

// A stored result and its location.
struct CommitRow {
  JobId job = 0;
  uint64_t unit = 0, shape = 0;
  Digest digest;
  std::string worker;
  bool verified = false;
  bool settled = false;  // the unit's result; until settled, a unit may have several that differ
  uint64_t epoch = 0;    // the store's opening that wrote it; with `file`, names the spool file
  uint32_t file = 0;
  uint64_t offset = 0;  // of the record, bytes
  uint32_t length = 0;  // of the payload, bytes
};

// One spool file (spool.h).
struct SpoolFileId {
  JobId job = 0;
  uint64_t epoch = 0;
  uint32_t file = 0;
  auto operator<=>(const SpoolFileId&) const = default;
};

// How a pass was cut into units: after a restart the same cut gives the same ids.
struct PassRecord {
  uint32_t pass = 0;
  uint64_t cut = 0;  // texels per unit, or another parameter of the cut
  bool operator==(const PassRecord&) const = default;
};

struct WorkerRecord {
  std::string identity;
  int64_t first_seen_ms = 0, last_seen_ms = 0;
  uint32_t threads = 0;
  std::vector<std::string> numeric_classes;
  uint64_t good_verifications = 0;  // in a row
  uint64_t units = 0, failures = 0;
  bool quarantined = false;
  std::string quarantine_reason;
  bool operator==(const WorkerRecord&) const = default;
};

}  // namespace kiln

// What the store keeps, as plain data. Times are Unix milliseconds and are for people only: no decision of
// the farm rests on them but the age at which ended jobs are forgotten.
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

// A file of a job by what is in it.
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
  std::vector<JobId> after;  // jobs that must be done before
  uint32_t quorum = 1;       // workers that must agree on a unit
  PoisonPolicy poison = PoisonPolicy::kFail;
  std::string settings;            // flat JSON (common/base/json.h)
  std::string submission;          // drawn by who submitted it: the same again is the same job, not another
  std::string numeric_class;       // of its results; empty: none yet
  std::vector<FileRecord> inputs;  // blobs
  std::string scene;               // which of them is the glTF
  uint32_t preparations = 0;  // times a conductor began it: a job that brings it down is stopped by count
  int64_t submitted_ms = 0, started_ms = 0, ended_ms = 0;  // 0: not yet
  uint32_t passes_done = 0;
  uint64_t units_done = 0, units_total = 0, texels = 0;
  double worst_relative_error = 0;  // stated, after the last pass
  double converged_share = 0;       // of the texels, 0 to 1
  std::vector<FileRecord> results;
  bool tainted = false;  // something in the result is not proved
  std::string taint;     // what: one sentence
  bool operator==(const JobRecord&) const = default;
};

// Fails (kInvalidInput, naming the field) on what the store refuses: priority, quorum, sizes, paths that
// leave their folder, a scene that is not among the inputs.
Status check_job(const JobRecord& job);

// The same for a list of files that came from elsewhere; `field` names it.
Status check_files(std::string_view field, const std::vector<FileRecord>& files);

struct JobEvent {
  int64_t at_ms = 0;
  std::string text;  // one sentence
};

// A unit's result, to be made durable.
struct UnitCommit {
  JobId job = 0;
  uint64_t unit = 0;  // of the job
  uint64_t shape =
      0;          // XXH3 of first sample, count and sites: another cut of units never takes this for its own
  Digest digest;  // result_digest()
  std::string worker;     // identity of who computed it
  bool verified = false;  // a second worker gave the same
};

// A stored result and where it lies.
struct CommitRow {
  JobId job = 0;
  uint64_t unit = 0, shape = 0;
  Digest digest;
  std::string worker;
  bool verified = false;
  bool settled = false;  // the one that counts; until then a unit may have several that differ
  uint64_t epoch = 0;    // opening of the store that wrote it; with `file` the name of the spool file
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
  uint64_t cut = 0;  // texels per unit, or what else the planner cuts by
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

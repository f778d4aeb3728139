// The coordinator's interface to its workers: hands out the units of many jobs, receives results, survives
// losses.
//
// A farm has its own thread for sockets, the ledger and local workers. Conductors, one thread per job, use it
// through FarmJob.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/job/unit.h"
#include "common/scene/prepared.h"
#include "common/wire/tls.h"
#include "coordinator/farm/dispatch/client_talk.h"
#include "coordinator/farm/dispatch/farm_status.h"
#include "coordinator/farm/dispatch/result_store.h"
#include "coordinator/farm/ledger/rules.h"
#include "coordinator/farm/ledger/verification.h"

namespace kiln {

struct FarmSettings {
  std::string listen_host = "127.0.0.1";
  uint16_t listen_port = 0;  // 0: any free port
  std::string token;         // workers must present it; empty: generated (loopback), or certificates decide
  std::map<std::string, std::string> owner_tokens;  // tokens of single owners of workers, by their names
  std::shared_ptr<const TlsContext> tls;            // null: plain TCP
  bool admit_strangers = false;  // with TLS: callers without a certificate may ask to be enrolled
  bool plain_is_fine = false;    // off loopback without TLS: explicitly allowed by the user
  uint32_t local_workers = 1;    // worker processes to spawn and keep alive
  uint32_t local_threads = 1;    // threads of each
  std::string worker_program;    // path of kiln-worker
  FarmRules rules;
  bool comes_back = false;       // at the end workers are not dismissed: they wait for the next coordinator
  bool others_may_come = false;  // a job refused by all present workers waits for others instead of failing
  ClientPort clients;            // handles clients; empty: refused
  // A connected peer was cut off, for its certificate was revoked. On the farm's thread.
  std::function<void(const PeerIdentity& whose, const std::string& peer)> on_revoked;
};

struct FarmProgress {
  uint64_t units_done = 0, units_total = 0;
  uint64_t rays = 0;
  uint32_t workers = 0, threads = 0;   // serving the job now
  double weight_done = 0, weight = 0;  // work of the pass: texels x samples
};

struct FarmStatistics {
  uint64_t rays = 0, units = 0, duplicates = 0, reassigned = 0, workers_lost = 0, nonfinite = 0;
  uint64_t copies = 0;  // units that were late and given to a second worker besides
  Verification verification;
  double worker_seconds = 0;  // thread-seconds of baking
  std::string numeric_class;
  std::vector<std::string> events;  // for the report: workers that joined or died, units reassigned
};

struct FarmJobSpec {
  JobSpec spec;                        // its id is the job's
  const ChunkStore* chunks = nullptr;  // holds the chunks that `spec` names; outlives the FarmJob
  JobTraits traits;
  std::vector<KnownAnswer> known;  // answers stored by an earlier run
};

enum class PassEnd {
  kComplete,
  kTimeUp,
  kRewound,  // delivered results are revoked: drop all sums and start again with the first pass
};

struct PassHandlers {
  std::function<Status(const WorkUnit&, const UnitResult&)> on_result;  // once per unit, in arrival order
  std::function<void(const WorkUnit&, const std::string& reason)>
      on_skipped;                                        // a unit that failed permanently
  std::function<void(const FarmProgress&)> on_progress;  // about ten times a second
};

// A conductor's handle of a job. Call it from one thread; the job ends with the object.
class FarmJob {
 public:
  virtual ~FarmJob() = default;
  // Adds a chunk for workers to fetch, besides those of FarmJobSpec::chunks, and returns the name by which
  // units of the next pass refer to it. Chunks that no unit of a pass names are dropped when the pass starts.
  virtual Digest add_chunk(Bytes bytes) = 0;
  // Hands out all units in order and calls the handlers on this thread. Returns when every unit has its
  // result, when a handler fails, when the job failed or was stopped, when no worker is available any more,
  // or at `deadline_ms` (clock of clock.h; 0: none) with the units done by then. After an error every further
  // pass fails with it.
  virtual Expected<PassEnd> run_pass(std::vector<WorkUnit> units, int64_t deadline_ms,
                                     const PassHandlers& handlers) = 0;
  virtual FarmStatistics statistics() = 0;
};

class Farm {
 public:
  // Listens, spawns the local workers and returns without waiting for them. Without a store, results are kept
  // in memory.
  static Expected<std::unique_ptr<Farm>> start(const FarmSettings& settings,
                                               std::shared_ptr<ResultStore> store = nullptr);
  virtual ~Farm() = default;  // stops and reaps the workers; no FarmJob may exist

  // Everything below is thread-safe.
  virtual Expected<std::unique_ptr<FarmJob>> open_job(const FarmJobSpec& job) = 0;
  virtual void change_job(JobId job, int32_t priority, bool paused) = 0;
  virtual void stop_job(JobId job, const Error& why) = 0;  // its run_pass returns `why`
  // Stops handing out units while the store cannot write.
  virtual void hold(bool on, const std::string& reason) = 0;
  virtual void restore_trust(const std::string& identity, uint64_t agreed,
                             const std::string& quarantined_for) = 0;
  virtual FarmStatus status() = 0;
  virtual std::vector<std::string> why_job(JobId job) = 0;
  virtual std::vector<std::string> why_unit(JobId job, uint64_t unit) = 0;
  virtual std::vector<std::string> why_worker(const std::string& number_or_name) = 0;
  virtual uint16_t port() const = 0;
  // Runs work on the farm's thread, where clients are served: for replies computed elsewhere.
  virtual void post(std::function<void()> work) = 0;
};

}  // namespace kiln

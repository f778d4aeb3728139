// The queue as a service: jobs arrive over the wire, wait their turn, are baked by the farm and
// kept until they are fetched. Whatever was acknowledged survives `kill -9` and a power cut.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/farm/documents/farm_source.h"
#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/store.h"
#include "coordinator/service/scene_check.h"

namespace kiln {

struct ServiceSettings {
  std::filesystem::path data;
  FarmSettings farm;  // `token` is the workers'; `clients` is set by the service
  uint32_t active_jobs = 4;
  uint32_t keep_days = 30;          // for ended jobs and their results
  uint32_t scrub_mib_s = 8;         // at which all that is stored is read once a week; 0: never
  std::filesystem::path authority;  // signs enrolments if it has ca.key; empty: data/authority
  std::string release;
  int64_t certificate_until = 0;  // of this coordinator's certificate, seconds since 1970
  StoreOptions store;
  // Tests: the wall clock and the steady clock, ms; empty: the machine's.
  std::function<int64_t()> wall_clock, steady_clock;
  std::string check_program;  // kiln, to prepare scenes apart; empty: they are prepared in this process alone
  PrepareLimits prepare;
};

class Service {
 public:
  // Opens the folder, takes over the jobs that an earlier service left and listens.
  static Expected<std::unique_ptr<Service>> start(const ServiceSettings& settings);
  virtual ~Service() = default;  // like stop() with unlimited patience

  virtual uint16_t port() const = 0;
  // Shuts down in order: nothing new starts, jobs return to the queue, the store is flushed. False if a stage
  // of a job still runs after `patience`: everything durable is safe and the process may exit.
  virtual bool stop(std::chrono::milliseconds patience) = 0;

  // Read-only, for HTTP (coordinator/farm/web); callable from any thread.
  virtual FarmSource source() = 0;            // valid as long as the service
  virtual std::vector<JobRecord> jobs() = 0;  // by id
  virtual std::optional<JobRecord> job(JobId id) = 0;
  virtual std::vector<JobEvent> events_of(JobId id) = 0;  // oldest first
  virtual BlobStore::Verified verified() const = 0;       // what was read back of stored files
};

// The workers' token, in the first line of its file. A further line "NAME TOKEN" is a token of NAME's own,
// who then is the owner of the workers that use it.
struct WorkerTokens {
  std::string shared;
  std::map<std::string, std::string> owners;
};
Expected<WorkerTokens> read_worker_tokens(const std::filesystem::path& file);

// Tokens of a coordinator: all but `web`, that of the pages, count without TLS only. Files that do not exist
// are made, readable by the owner alone.
struct ServiceTokens {
  std::string admin, submit, read, web;
  WorkerTokens worker;
};
Expected<ServiceTokens> service_tokens(const std::filesystem::path& data);

}  // namespace kiln

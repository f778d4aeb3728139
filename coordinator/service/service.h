// The queue as a service: jobs come in over the wire, wait their turn, are baked by the farm and kept until
// they are fetched. What was acknowledged survives `kill -9` and a power cut.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/farm/queue/store.h"

namespace kiln {

struct ServiceSettings {
  std::filesystem::path data;
  FarmSettings farm;  // `token` is that of workers; `clients` is the service's own
  uint32_t active_jobs = 4;
  uint32_t keep_days = 30;          // ended jobs and their results
  std::filesystem::path authority;  // signs enrolments, if it has ca.key; empty: data/authority
  std::string release;
  StoreOptions store;
};

class Service {
 public:
  // Opens the folder, takes up the jobs that an earlier one left and listens.
  static Expected<std::unique_ptr<Service>> start(const ServiceSettings& settings);
  virtual ~Service() = default;  // as stop() without a bound on patience

  virtual uint16_t port() const = 0;
  // Ends in order: nothing new is begun, jobs go back to the queue, the store is flushed. False if a stage of
  // a job still runs after `patience`: everything durable is safe, the process may end.
  virtual bool stop(std::chrono::milliseconds patience) = 0;

  // Read-only, for HTTP (coordinator/farm/web); from any thread.
  virtual FarmStatus farm_status() = 0;
  virtual std::vector<JobRecord> jobs() = 0;  // by id
  virtual std::optional<JobRecord> job(JobId id) = 0;
  virtual std::vector<JobEvent> events_of(JobId id) = 0;  // oldest first
  virtual std::string held_for() const = 0;               // why the disk takes no writes; empty: it does
  virtual uint64_t log_bytes() = 0;                       // of the database's log
};

// Tokens of a coordinator without TLS. Made, readable for the owner alone, if the files are not there.
struct ServiceTokens {
  std::string admin, submit, read, worker;
};
Expected<ServiceTokens> service_tokens(const std::filesystem::path& data);

}  // namespace kiln

// A snapshot of the farm for users and metrics collectors.
#pragma once

#include <string>
#include <vector>

#include "coordinator/farm/ledger/rules.h"

namespace kiln {

struct WorkerStatus {
  WorkerId id = 0;
  std::string name, identity, peer, release;
  uint32_t threads = 0;
  JobId job = 0;      // 0: none
  std::string state;  // "baking", "idle", "preparing", "silent", "leaving", "benched"
  uint32_t units_held = 0, credits = 0;
  uint64_t units_done = 0, units_failed = 0, rays = 0;
  double rays_per_second = 0;  // over the results of the last minute
  uint64_t agreed = 0;
  uint64_t queued_bytes = 0;  // waiting to be sent to it
  std::string owner{};        // WorkerTraits::owner
};

struct FarmJobStatus {
  JobId job = 0;
  std::string user;
  uint32_t pass = 0, workers = 0, threads = 0;
  uint64_t units_done = 0, units_total = 0, units_failed = 0;
  double weight_done = 0, weight = 0;
  uint64_t rays = 0, verified = 0, unverified = 0, waived = 0, disputes = 0;
};

struct FarmStatus {
  std::vector<WorkerStatus> workers;
  std::vector<FarmJobStatus> jobs;
  uint64_t connections = 0, clients = 0;
  uint64_t results = 0, rays = 0, duplicates = 0, refused_connections = 0, expelled = 0;  // since the start
  bool owners_known = false;  // FarmRules::owners_known
  std::string held_for;       // why no units are handed out; empty: they are
};

}  // namespace kiln

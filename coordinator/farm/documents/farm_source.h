// A farm as pages, metrics and clients see it: read-only, from any thread.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/farm/dispatch/farm_status.h"
#include "coordinator/farm/queue/growth.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

// The data folder: its size, and what becomes of it.
struct DataReport {
  DataSizes sizes;
  std::optional<std::array<double, kDataKinds.size()>>
      bytes_a_day;                          // nullopt: observed for less than an hour
  uint64_t disk_bytes = 0, free_bytes = 0;  // of its file system; free to this user
  std::optional<double> days_until_full;    // nullopt: it does not grow
  uint32_t keep_days = 0;
  NextDeletion next;
  int64_t backup_ms = 0;                       // of the last backup, Unix ms; 0: none is known
  uint64_t backup_bytes = 0, backup_jobs = 0;  // copied by it; jobs in it
};

struct FarmHealth {
  std::string release;
  uint64_t epoch = 0;
  int64_t now_ms = 0;       // for people, Unix ms
  std::string held_for;     // why nothing is stored or handed out; empty: it is
  std::string clock_doubt;  // why nothing is deleted for its age; empty: the clock is believed
  uint64_t wal_bytes = 0;
  // Of what was read back: bytes of files, files and results of units that were damaged.
  uint64_t verified_bytes = 0, damaged_blobs = 0, damaged_results = 0;
  bool tls = false;
  int64_t certificate_until = 0;  // seconds since 1970; with TLS
  uint64_t revoked_lists = 0, revoked_serials = 0;
  DataReport data;
};

// Where a job that has a conductor is.
struct JobProgress {
  std::string stage;
  uint32_t pass = 0;         // from 1
  double seconds_left = -1;  // -1: unknown
};

struct FarmSource {
  std::function<FarmStatus()> farm;
  std::function<std::vector<JobRecord>()> jobs;  // by id
  std::function<std::optional<JobRecord>(JobId)> job;
  std::function<std::vector<JobEvent>(JobId)> events;  // oldest first
  std::function<std::optional<JobProgress>(JobId)> progress;
  std::function<std::vector<WorkerRecord>()> workers;  // all that are known
  std::function<FarmHealth()> health;
};

}  // namespace kiln

// A tiny job and a farm of stub workers to bake it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>

#include "coordinator/farm/dispatch/farm.h"

namespace kiln::test {

struct TestJob {
  // Jobs of one variant share their chunks.
  explicit TestJob(uint64_t id = 77, uint32_t variant = 0);
  ChunkStore chunks;
  JobSpec spec;
};

std::vector<WorkUnit> make_units(uint64_t first_id, size_t count, uint32_t first_sample = 0);

// Sets KILN_STUB for as long as it lives.
class StubOptions {
 public:
  explicit StubOptions(const std::string& text);
  ~StubOptions();
};

FarmSettings stub_settings(uint32_t workers, uint32_t threads = 1);

struct PassOutcome {
  Expected<bool> complete = false;                  // false: time was up
  std::map<uint64_t, std::vector<double>> moments;  // by unit
  FarmStatistics statistics;
  std::string events() const;  // one a line
};

// A farm with one job.
struct TestFarm {
  std::unique_ptr<Farm> farm;
  std::unique_ptr<FarmJob> job;  // ends before its farm
};
Expected<TestFarm> start_farm(const FarmSettings& settings, const TestJob& job, const JobTraits& traits = {});

// Starts a farm, runs one pass and ends the farm. `on_result` is called with the number of results so far.
PassOutcome bake(const FarmSettings& settings, std::vector<WorkUnit> units,
                 const std::function<void(size_t)>& on_result = {}, int64_t deadline_ms = 0,
                 const JobTraits& traits = {});

// Asks every unit twice.
JobTraits quorum_of_two();

std::vector<pid_t> children_of(pid_t process);
// The living workers that began a unit, by the marks of stubs told "dir=DIR". Others may not have joined yet.
std::vector<pid_t> busy_workers(const std::filesystem::path& dir);
bool alive(pid_t process);  // and not a zombie

}  // namespace kiln::test

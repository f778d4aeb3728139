// What one coordinator carries: farm_load [rate|pace|reconnect|restart|share|all] [--peers N] [--units N]
//
// A real Farm in this process; in another, many workers that bake nothing (stub_peers.h), so that both of the
// machine's processors are in use and this process's memory is the coordinator's.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/responses/quantities.h"
#include "coordinator/farm/dispatch/farm.h"
#include "tests/bench/share_error.h"
#include "tests/bench/spool_results.h"
#include "tests/bench/stub_peers.h"

namespace kiln::bench {
namespace {

constexpr JobId kJob = 1;

struct Sizes {
  uint32_t peers = 0;
  size_t units = 100000;
};

FarmJobSpec make_job(ChunkStore& chunks) {
  FarmJobSpec job;
  job.spec.id = kJob;
  job.spec.transport.basis = 0;
  job.spec.scene = chunks.add(Bytes(64, std::byte{1}));  // nobody bakes it
  job.spec.atlas = chunks.add(Bytes(64, std::byte{2}));
  job.chunks = &chunks;
  job.traits.user = "ada";
  return job;
}

uint32_t planes() {
  return static_cast<uint32_t>(MomentLayout(0).planes());
}

std::vector<WorkUnit> make_units(size_t count) {
  std::vector<WorkUnit> units(count);
  for (size_t i = 0; i < count; ++i) units[i] = {i + 1, 0, 16, {static_cast<uint32_t>(i)}};
  return units;
}

double resident_mib() {
  FILE* status = std::fopen("/proc/self/status", "r");
  char line[256];
  double kib = 0;
  while (std::fgets(line, sizeof line, status))
    if (!std::strncmp(line, "VmRSS:", 6)) kib = std::atof(line + 6);
  std::fclose(status);
  return kib / 1024;
}

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Outcome {
  double seconds = 0, processor = 0, before_mib = 0, connected_mib = 0, after_mib = 0;
  size_t delivered = 0;
  PeerFigures peers;
};

// `folder` empty: results are kept in memory.
Outcome run(const PeerPlan& plan, size_t units, const std::filesystem::path& folder, FarmRules rules = {}) {
  Outcome outcome;
  PeerPlan while_there_are_units = plan;
  while_there_are_units.measured = units - std::min(units / 2, size_t{4} * plan.peers * plan.credits);
  StubPeers peers(while_there_are_units);
  FarmSettings settings;
  settings.local_workers = 0;
  settings.token = "load";
  settings.rules = rules;
  settings.others_may_come = true;
  DiskResults disk;
  if (!folder.empty()) disk = open_disk_results(folder);
  auto farm = Farm::start(settings, disk.results);
  KILN_CHECK(farm);
  outcome.before_mib = resident_mib();
  peers.begin((*farm)->port());
  peers.wait_until_welcome();
  outcome.connected_mib = resident_mib();
  ChunkStore chunks;
  auto job = (*farm)->open_job(make_job(chunks));
  KILN_CHECK(job);
  PassHandlers handlers;
  double first = 0, last = 0;
  handlers.on_result = [&](const WorkUnit&, const UnitResult&) -> Status {
    last = steady_seconds();
    if (outcome.delivered++ == 0) first = last;
    return {};
  };
  const double processor = processor_seconds();
  const auto end = (*job)->run_pass(make_units(units), 0, handlers);
  KILN_CHECK(end && *end == PassEnd::kComplete);
  outcome.processor = processor_seconds() - processor;
  outcome.seconds = last - first;
  outcome.after_mib = resident_mib();
  job->reset();
  farm->reset();
  outcome.peers = peers.figures();
  return outcome;
}

// A folder of its own, on the disk of the working folder: /tmp may be memory.
struct Folder {
  std::filesystem::path path = std::filesystem::absolute(text("farm_load.{}", ::getpid()));
  ~Folder() { std::filesystem::remove_all(path); }
};

void print_rate(const char* what, const PeerPlan& plan, const Outcome& o) {
  std::printf(
      "%-28s %5u workers  %8.0f results/s  %5.1f us of processor each  %5.1f MiB\n"
      "%-28s result sent to next unit: p50 %.2f ms, p99 %.2f ms, p99.9 %.2f ms, worst %.1f ms\n",
      what, plan.peers, static_cast<double>(o.delivered) / o.seconds,
      1e6 * o.processor / static_cast<double>(o.delivered), o.after_mib, "", o.peers.p50_ms, o.peers.p99_ms,
      o.peers.p999_ms, o.peers.worst_ms);
  std::fflush(stdout);
}

void rate(const Sizes& sizes) {
  std::printf("\nas fast as they can (a worker answers at once, and has 3 units at a time)\n");
  for (const uint32_t count : sizes.peers ? std::vector{sizes.peers} : std::vector{16u, 1000u}) {
    PeerPlan plan{.peers = count, .planes = planes()};
    print_rate("memory", plan, run(plan, sizes.units, {}));
    const Folder folder;
    print_rate("on disk", plan, run(plan, sizes.units, folder.path));
    FarmRules rules;
    rules.audit_first = 10;
    const Folder other;
    print_rate("on disk, verified by dose", plan, run(plan, sizes.units, other.path, rules));
  }
}

void pace(const Sizes& sizes) {
  const uint32_t count = sizes.peers ? sizes.peers : 1000;
  std::printf("\n5,000 units a second are asked for (a unit takes a worker %u ms)\n", count / 5);
  const PeerPlan plan{.peers = count, .planes = planes(), .unit_ms = count / 5.0};
  print_rate("memory", plan, run(plan, sizes.units, {}));
  const Folder folder;
  const Outcome o = run(plan, sizes.units, folder.path);
  print_rate("on disk", plan, o);
  std::printf("memory of the coordinator: %.1f MiB, with %u connections %.1f MiB, after %zu units %.1f MiB\n",
              o.before_mib, count, o.connected_mib, sizes.units, o.after_mib);
}

void reconnect(const Sizes& sizes) {
  const PeerPlan plan{.peers = sizes.peers ? sizes.peers : 1000, .planes = planes(), .reconnect = true};
  const Outcome o = run(plan, 10000, {});
  std::printf("\n%u workers: all welcome after %.2f s; all dropped at once, all welcome again after %.2f s\n",
              plan.peers, o.peers.all_welcome_s, o.peers.reconnected_s);
}

void restart(const Sizes& sizes) {
  const Folder folder;
  fill_store(folder.path, kJob, make_units(sizes.units), planes());
  StubPeers peers({.peers = 16, .planes = planes()});
  const double begun = steady_seconds();
  const DiskResults disk = open_disk_results(folder.path);
  const double opened = steady_seconds();
  ChunkStore chunks;
  FarmJobSpec spec = make_job(chunks);
  spec.known = disk.known(kJob);
  const double known = steady_seconds();
  FarmSettings settings;
  settings.local_workers = 0;
  settings.token = "load";
  settings.others_may_come = true;
  auto farm = Farm::start(settings, disk.results);
  KILN_CHECK(farm);
  peers.begin((*farm)->port());
  peers.wait_until_welcome();
  const double welcome = steady_seconds();
  auto job = (*farm)->open_job(spec);
  KILN_CHECK(job);
  std::vector<WorkUnit> units = make_units(sizes.units + 1000);
  const auto end = (*job)->run_pass(std::move(units), 0, {});
  KILN_CHECK(end && *end == PassEnd::kComplete);
  const double done = steady_seconds();
  job->reset();
  farm->reset();
  std::printf(
      "\nrestart with %zu results on disk: store open %.2f s, rows read %.2f s, 16 workers there %.2f s, "
      "first "
      "unit with a worker %.2f s, all results read back and merged %.2f s (since the start)\n",
      sizes.units, opened - begun, known - begun, welcome - begun, peers.figures().first_unit_at_s - begun,
      done - begun);
}

void share(const Sizes&) {
  std::printf("\nfair share, simulated time (share_error.h)\n");
  for (const ShareCase& c : share_cases()) {
    const ShareFigures f = measure_share(c);
    std::printf(
        "%-44s %3u users %4u jobs %5u workers: worst error %.2f %% (of %s), %.0f units/s of our time\n",
        c.name, c.users, c.users * c.jobs_each, c.workers, 100 * f.worst_error, f.worst_user.c_str(),
        f.units_per_second);
    std::fflush(stdout);
  }
}

int main_(int argc, char** argv) {
  Sizes sizes;
  std::string what = "all";
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--peers") && i + 1 < argc)
      sizes.peers = static_cast<uint32_t>(std::atoi(argv[++i]));
    else if (!std::strcmp(argv[i], "--units") && i + 1 < argc)
      sizes.units = static_cast<size_t>(std::atoll(argv[++i]));
    else
      what = argv[i];
  }
  const std::pair<const char*, void (*)(const Sizes&)> parts[] = {
      {"rate", rate}, {"pace", pace}, {"reconnect", reconnect}, {"restart", restart}, {"share", share}};
  bool any = false;
  for (const auto& [name, part] : parts)
    if (what == "all" || what == name) part(sizes), any = true;
  if (any) return 0;
  std::fprintf(stderr, "usage: farm_load [rate|pace|reconnect|restart|share|all] [--peers N] [--units N]\n");
  return 2;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  return kiln::bench::main_(argc, argv);
}

// Committed results a second, and how long it takes to load them, for docs/storage.md: store_rate [FOLDER].
#include <cstdio>
#include <cstdlib>

#include "common/base/clock.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

// `given` results are under way at any time: more means larger groups.
double rate(const fs::path& folder, size_t payload_bytes, int given, int count) {
  const auto store = open_store(folder);
  const JobId job = *store->submit(sample_job());
  std::vector<UnitCommit> commits;
  std::vector<std::shared_ptr<const Bytes>> payloads;
  for (int i = 0; i < count; ++i) {
    payloads.push_back(
        std::make_shared<const Bytes>(sample_payload(static_cast<uint64_t>(i), payload_bytes)));
    commits.push_back(sample_commit(job, static_cast<uint64_t>(i), *payloads.back()));
  }
  std::mutex mutex;
  std::condition_variable changed;
  int open = 0;
  bool good = true;
  const Stopwatch watch;
  for (int i = 0; i < count; ++i) {
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return open < given; });
      ++open;
    }
    store->commit_result(commits[static_cast<size_t>(i)], payloads[static_cast<size_t>(i)],
                         [&](Status status) {
                           const std::lock_guard lock(mutex);
                           good = good && status;
                           --open;
                           changed.notify_one();
                         });
  }
  (void)store->flush();
  const double seconds = watch.seconds();
  if (!good) std::printf("a commit failed\n");
  return count / seconds;
}

int run(const fs::path& folder) {
  std::printf("committed results a second\n%10s %12s %12s %12s\n", "payload", "1 at a time", "64", "1024");
  int number = 0;
  for (const size_t bytes : {size_t{0}, size_t{4} << 10, size_t{40} << 10}) {
    std::printf("%10zu", bytes);
    for (const int given : {1, 64, 1024}) {
      const int count = given == 1 ? 500 : given == 64 ? 10000 : bytes > 10000 ? 10000 : 50000;
      const fs::path here = folder / std::to_string(number++);
      std::printf(" %12.0f", rate(here, bytes, given, count));
      std::fflush(stdout);
      fs::remove_all(here);
    }
    std::printf("\n");
  }
  const fs::path here = folder / "load";
  (void)rate(here, 100, 1024, 100000);
  const Stopwatch opening;
  const auto store = open_store(here);
  const double opened = opening.seconds();
  const Stopwatch loading;
  const auto rows = store->commits(1);
  const double loaded = loading.seconds();
  const Stopwatch reading;
  size_t bytes = 0;
  for (const CommitRow& row : *rows) bytes += store->read_result(row)->size();
  std::printf(
      "%zu results: store opened in %.3f s, rows loaded in %.3f s, payloads (%zu bytes) read in %.3f s\n",
      rows->size(), opened, loaded, bytes, reading.seconds());
  fs::remove_all(here);
  return 0;
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  if (argc > 1) return kiln::test::run(argv[1]);
  const kiln::test::TempDir dir;
  return kiln::test::run(dir.path());
}

// A service with many jobs and results: store_scale [--jobs N] [--results N] [--owners N] [--bytes N]
//
// Fills a data folder as a farm does (a commit and a settlement for each result), starts a service on it, and
// lists the jobs with a client over the wire. The results belong to `owners` of the jobs, evenly; these have
// failed, since jobs that are done have none.
#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <semaphore>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/farm/client/service_client.h"
#include "coordinator/service/service.h"

namespace kiln::bench {
namespace {

struct Sizes {
  size_t jobs = 1000, results = 1'000'000, owners = 1000, bytes = 256;
};

// On the disk of the working folder: /tmp may be memory.
struct Folder {
  std::filesystem::path path = std::filesystem::absolute(text("store_scale.{}", ::getpid()));
  ~Folder() { std::filesystem::remove_all(path); }
};

std::vector<JobId> submit_jobs(Store& store, const Sizes& sizes) {
  std::vector<JobId> ids;
  for (size_t i = 0; i < sizes.jobs; ++i) {
    JobRecord job;
    job.name = text("room {}", i);
    job.user = text("user {}", i % 50);
    job.settings = "{\"quality\":\"medium\"}";
    job.inputs = {{"room.gltf", sha256(bytes_of(job.name)), 20000}, {"room.bin", {}, 4000000}};
    job.scene = "room.gltf";
    job.state = i < sizes.owners ? JobState::kFailed : JobState::kDone;
    job.reason = i < sizes.owners ? "unit 7 failed three times" : "";
    const auto now_ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                            std::chrono::system_clock::now().time_since_epoch())
                            .count();
    job.submitted_ms = job.started_ms = job.ended_ms = now_ms;
    const auto id = store.submit(job);
    KILN_CHECK(id);
    ids.push_back(*id);
  }
  return ids;
}

// Returns the results committed a second.
double fill(Store& store, const std::vector<JobId>& jobs, const Sizes& sizes) {
  std::counting_semaphore<> room(1024);
  const auto good = [&room](const Status& status) {
    KILN_CHECK(status);
    room.release();
  };
  Bytes bytes(sizes.bytes);
  const Stopwatch watch;
  for (size_t i = 0; i < sizes.results; ++i) {
    const JobId job = jobs[i * sizes.owners / sizes.results];
    std::memcpy(bytes.data(), &i, std::min(sizeof i, bytes.size()));
    const UnitCommit commit{job, i + 1, 7, sha256(bytes), "render7", false};
    room.acquire();
    store.commit_result(commit, std::make_shared<const Bytes>(bytes), good);
    room.acquire();
    store.settle(job, commit.unit, commit.digest, false, "", good);
  }
  KILN_CHECK(store.flush());
  return static_cast<double>(sizes.results) / watch.seconds();
}

// As after a reboot: the kernel holds nothing of the folder.
void make_cold(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const int file = ::open(entry.path().c_str(), O_RDONLY | O_CLOEXEC);
    KILN_CHECK(file >= 0 && ::fsync(file) == 0);
    KILN_CHECK(::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED) == 0);
    ::close(file);
  }
}

ClientOptions client_of(const std::filesystem::path& data, const Service& service) {
  const auto token = read_file(data / "read.token");
  KILN_CHECK(token && !token->empty());
  ClientOptions options;
  options.server = text("127.0.0.1:{}", service.port());
  options.user = "ada";
  options.token.assign(reinterpret_cast<const char*>(token->data()), token->size() - 1);
  return options;
}

int run(const Sizes& sizes) {
  const Folder folder;
  {
    auto store = Store::open(folder.path, {});
    KILN_CHECK(store);
    const std::vector<JobId> jobs = submit_jobs(**store, sizes);
    std::printf("%zu results of %zu bytes, of %zu among %zu jobs: %.0f a second committed and settled\n",
                sizes.results, sizes.bytes, sizes.owners, sizes.jobs, fill(**store, jobs, sizes));
    std::fflush(stdout);
    const Stopwatch closing;
    store->reset();
    std::printf("store closed in %.3f s\n", closing.seconds());
  }
  for (const char* state : {"warm", "cold"}) {
    if (*state == 'c') make_cold(folder.path);
    const Stopwatch opening;
    auto store = Store::open(folder.path, {});
    KILN_CHECK(store);
    std::printf("store opened in %.3f s (%s)\n", opening.seconds(), state);
    const Stopwatch late;
    KILN_CHECK((*store)->compact());
    std::printf("  what it left for later took %.3f s\n", late.seconds());
  }
  make_cold(folder.path);
  ServiceSettings settings;
  settings.data = folder.path;
  settings.keep_days = 36500;
  settings.farm.local_workers = 0;
  const Stopwatch starting;
  auto service = Service::start(settings);
  if (!service) std::printf("%s\n", service.error().message.c_str());
  KILN_CHECK(service);
  const double started = starting.seconds();
  auto client = ServiceClient::connect(client_of(folder.path, **service));
  KILN_CHECK(client && (*client)->call("status", "{}"));
  std::printf("service started in %.3f s, first answer after %.3f s (cold)\n", started, starting.seconds());
  for (int i = 0; i < 3; ++i) {
    const Stopwatch listing;
    const auto list = (*client)->call("jobs", R"({"most":1000})");
    KILN_CHECK(list);
    std::printf("jobs listed in %.3f s (%.1f KiB)\n", listing.seconds(),
                static_cast<double>(list->size()) / 1024);
  }
  return 0;
}

int main_(int argc, char** argv) {
  Sizes sizes;
  const std::pair<const char*, size_t*> options[] = {{"--jobs", &sizes.jobs},
                                                     {"--results", &sizes.results},
                                                     {"--owners", &sizes.owners},
                                                     {"--bytes", &sizes.bytes}};
  for (int i = 1; i < argc; i += 2) {
    bool known = false;
    for (const auto& [name, value] : options)
      if (i + 1 < argc && !std::strcmp(argv[i], name)) {
        *value = static_cast<size_t>(std::atoll(argv[i + 1]));
        known = true;
      }
    if (known && sizes.owners > 0 && sizes.owners <= sizes.jobs) continue;
    std::fprintf(stderr, "usage: store_scale [--jobs N] [--results N] [--owners N <= jobs] [--bytes N]\n");
    return 2;
  }
  return run(sizes);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  return kiln::bench::main_(argc, argv);
}

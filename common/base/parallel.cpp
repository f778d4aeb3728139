#include "common/base/parallel.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "common/base/clock.h"

namespace kiln {
namespace {

// The lowest limit from our group up to the root; "max" and a missing file mean no limit.
uint64_t group_limit(const std::string& root, std::string group, const std::string& file) {
  uint64_t least = ~uint64_t{0};
  for (;;) {
    uint64_t limit = 0;
    if (std::ifstream in(root + group + "/" + file); in >> limit) least = std::min(least, limit);
    if (group.find_last_not_of("/") == std::string::npos || group.front() != '/') return least;
    group.resize(group.rfind('/'));
  }
}

}  // namespace

unsigned hardware_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1u, std::thread::hardware_concurrency());
}

uint64_t memory_bytes() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGE_SIZE);
  uint64_t bytes =
      pages > 0 && size > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(size) : uint64_t{1} << 31;
  std::ifstream in("/proc/self/cgroup");  // lines "number:controllers:/group"
  for (std::string line; std::getline(in, line);) {
    const size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1),
                      group = line.substr(second + 1);
    if (controllers.empty()) bytes = std::min(bytes, group_limit("/sys/fs/cgroup", group, "memory.max"));
    if (controllers == "memory")
      bytes = std::min(bytes, group_limit("/sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
  }
  return bytes;
}

void parallel_for(size_t count, const std::function<void(size_t)>& body, unsigned threads) {
  const size_t n = std::min<size_t>(count, threads ? threads : hardware_threads());
  std::atomic<size_t> next{0};
  std::exception_ptr thrown;
  std::mutex mutex;
  auto run = [&] {
    try {
      for (size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {  // a thread that ends by an exception would end the program
      const std::lock_guard lock(mutex);
      if (!thrown) thrown = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> team;
    try {
      team.reserve(n);
      for (size_t t = 1; t < n; ++t) team.emplace_back(run);
    } catch (const std::system_error&) {  // no more threads are to be had: those that run do the work
    }
    run();
  }
  if (thrown) std::rethrow_exception(thrown);
}

double foretold_seconds(double seconds, size_t asked, size_t count, unsigned threads) {
  const size_t n = threads ? threads : hardware_threads();
  const auto turns = [&](size_t indices) { return static_cast<double>((indices + n - 1) / n); };
  return asked > 0 ? seconds * turns(count) / turns(asked) : 0;
}

bool parallel_for_within(double most_seconds, size_t count, const std::function<void(size_t)>& body,
                         unsigned threads) {
  // One index in 64 if there are many, one in four at most if there are few.
  constexpr size_t kAsked = 64, kEnough = 16, kMostAsked = 4;
  const size_t stride = std::clamp(count / kEnough, kMostAsked, kAsked),
               asked = (count + stride - 1) / stride;
  const Stopwatch watch;
  parallel_for(
      asked, [&](size_t i) { body(i * stride); }, threads);
  if (foretold_seconds(watch.seconds(), asked, count, threads) > most_seconds) return false;
  parallel_for(
      count,
      [&](size_t i) {
        if (i % stride) body(i);
      },
      threads);
  return true;
}

}  // namespace kiln

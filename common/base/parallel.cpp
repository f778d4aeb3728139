#include "common/base/parallel.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace kiln {

unsigned hardware_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1u, std::thread::hardware_concurrency());
}

uint64_t memory_bytes() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGE_SIZE);
  return pages > 0 && size > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(size)
                               : uint64_t{1} << 31;
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

}  // namespace kiln

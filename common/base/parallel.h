// Fork and join over an index range. Results must not depend on which thread ran an index.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace kiln {

unsigned hardware_threads();  // processors this process may use, at least 1

// Memory that this process may use: the machine's, or the limit of its control group (v2 or v1) if that is
// less.
uint64_t memory_bytes();

// Calls body(i) once for each i in [0, count), on up to `threads` threads (0: all). If
// one throws, the rest is left and the first exception reaches the caller.
void parallel_for(size_t count, const std::function<void(size_t)>& body, unsigned threads = 0);

// Seconds that `count` indices take if `asked` of them took `seconds`, both on up to `threads` threads (0:
// all) and all alike.
double foretold_seconds(double seconds, size_t asked, size_t count, unsigned threads = 0);

// As parallel_for, for bodies that take about as long as each other; or, where some of the indices, spread
// over all, foretell that the whole would take more than `most_seconds`, for these alone, and returns false.
bool parallel_for_within(double most_seconds, size_t count, const std::function<void(size_t)>& body,
                         unsigned threads = 0);

// Calls body(begin, end) for runs that cover [0, count): for bodies with costly set-up or little work per
// index.
constexpr size_t kParallelRun = 1024;
template <class Body>
void for_each_run(size_t count, unsigned threads, const Body& body) {
  parallel_for((count + kParallelRun - 1) / kParallelRun,
               [&](size_t run) { body(run * kParallelRun, std::min(count, (run + 1) * kParallelRun)); },
               threads);
}

// Calls body(i) once for each i in [0, count), in such runs.
template <class Body>
void for_each_index(size_t count, unsigned threads, const Body& body) {
  for_each_run(count, threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) body(i);
  });
}

}  // namespace kiln

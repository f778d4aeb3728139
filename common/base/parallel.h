// Fork and join over an index range. Results must not depend on which thread ran an index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace kiln {

unsigned hardware_threads();  // processors this process may use, at least 1

uint64_t memory_bytes();  // physical memory of this machine

// Calls body(i) once for each i in [0, count), on up to `threads` threads (0: all).
void parallel_for(size_t count, const std::function<void(size_t)>& body, unsigned threads = 0);

}  // namespace kiln

// The workers of a bake that runs in the test's own process.
#pragma once

#include <sys/types.h>

#include <set>

namespace kiln::test {

// Processes whose parent is this one and that run kiln-worker.
std::set<pid_t> worker_processes();
// The one of them that has computed longest, so has begun units; 0: there is none.
pid_t busiest_worker();

}  // namespace kiln::test

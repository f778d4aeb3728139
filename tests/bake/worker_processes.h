// The workers of a bake that runs in the test's own process.
#pragma once

#include <sys/types.h>

#include <set>

namespace kiln::test {

// Processes whose parent is this one and that run kiln-worker.
std::set<pid_t> worker_processes();

}  // namespace kiln::test

// A worker program from its first line to its exit status.
#pragma once

#include <string>
#include <vector>

#include "worker/agent/agent.h"

namespace kiln {

// This process is killed when process `parent`, our parent, ends; false if it already has.
bool die_with_parent(int parent);

// Everything a worker's main does: options, log, agent or replay, exit status.
int worker_main(const std::vector<std::string>& arguments, const std::string& engine,
                const BakerFactory& make_baker, const NumericClassFunction& numeric_class);

}  // namespace kiln

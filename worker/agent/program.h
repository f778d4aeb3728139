// The worker program from start to exit status.
#pragma once

#include <string>
#include <vector>

#include "worker/agent/agent.h"

namespace kiln {

// Makes the kernel kill this process when our parent process `parent` ends; false if it already has.
bool die_with_parent(int parent);

// The body of a worker's main: options, log, agent or replay, exit status.
int worker_main(const std::vector<std::string>& arguments, const std::string& engine,
                const BakerFactory& make_baker, const NumericClassFunction& numeric_class,
                const ProbeBakerFactory& make_probe_baker = {});

}  // namespace kiln

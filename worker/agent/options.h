// The command line and environment of a worker program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "worker/agent/agent.h"

namespace kiln {

struct WorkerOptions {
  AgentSettings agent;  // without the factories
  std::string print;    // text that was asked for (--help, --version): print it and leave with 0
  int parent = 0;       // process id of a coordinator that started us; 0: none
};

// Errors are kUsage and say what to write instead.
Expected<WorkerOptions> read_worker_options(const std::vector<std::string>& arguments);

// This process is killed when process `parent`, our parent, ends; false if it already has.
bool die_with_parent(int parent);

// Everything a worker's main does: options, log, agent, exit status.
int worker_main(const std::vector<std::string>& arguments, const std::string& engine,
                const BakerFactory& make_baker, const NumericClassFunction& numeric_class);

}  // namespace kiln

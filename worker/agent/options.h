// The command line and environment of a worker program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/log.h"
#include "worker/agent/agent.h"

namespace kiln {

struct WorkerOptions {
  AgentSettings agent;  // without the factories
  LogFormat log = LogFormat::kText;
  std::string canary;  // kernels whose numeric class is to be printed
  std::string replay;  // bake the unit of this file and end
  std::string print;   // text that was asked for (--help, --version): print it and leave with 0
  int parent = 0;      // process id of a coordinator that started us; 0: none
};

// Every option has a variable KILN_NAME and, but for those that are paths already, KILN_NAME_FILE: a file
// that holds the value. The command line wins. Errors are kUsage and say what to write instead.
Expected<WorkerOptions> read_worker_options(const std::vector<std::string>& arguments);

}  // namespace kiln

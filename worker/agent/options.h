// Command line and environment of the worker program.
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
  std::string canary;  // print the numeric class of these kernels
  std::string replay;  // bake the unit in this file and exit
  std::string play;    // play the recording in this file and exit
  std::string print;   // text to print (--help, --version) before exiting with 0
  int parent = 0;      // process id of the coordinator that started us; 0: none
};

// Every option has a variable KILN_NAME and, unless it is a path itself, KILN_NAME_FILE, a file with the
// value. The command line takes precedence. Errors are kUsage and tell what to write instead.
Expected<WorkerOptions> read_worker_options(const std::vector<std::string>& arguments);

}  // namespace kiln

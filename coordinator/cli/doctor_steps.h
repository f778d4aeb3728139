// What can be wrong between this machine and a coordinator, a step each. Internal to coordinator/cli.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/tls/identity.h"

namespace kiln {

struct DoctorPlan {
  std::string server;  // HOST:PORT; empty: only this machine is looked at
  std::string token;
  TlsFiles tls;
  std::string data;     // folder of a coordinator
  bool worker = false;  // speak as a worker: its token, certificate and resources
  std::string worker_program;
};

struct DoctorStep {
  std::string name, finding;
  bool good = true;
  std::string remedy;  // of a bad one
};

// Runs the steps in order up to the first that fails; each is told when it is done.
std::vector<DoctorStep> run_doctor(const DoctorPlan& plan,
                                   const std::function<void(const DoctorStep&)>& on_step);

}  // namespace kiln

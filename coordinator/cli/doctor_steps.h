// Checks of the connection between this machine and a coordinator, one step each. Internal to
// coordinator/cli.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/tls/identity.h"

namespace kiln {

struct DoctorPlan {
  std::string server;  // HOST:PORT; empty: check only this machine
  std::string token;
  TlsFiles tls;
  std::string data;           // a coordinator's folder
  std::string authority;      // a folder made by `kiln cert ca`: is its list of revoked certificates heard?
  bool accept_clock = false;  // of the data folder: believe this machine's clock
  bool deep = false;          // read all that is stored there
  std::string backup;         // a folder made by `kiln backup`
  bool worker = false;        // connect as a worker: check its token, certificate and resources
  std::string worker_program;
};

struct DoctorStep {
  std::string name, finding;
  bool good = true;
  std::string remedy;  // of a failed step
};

// doctor_data.cpp: whether the coordinator of a data folder believes the clock, by which it deletes old jobs;
// or tells it to.
DoctorStep look_at_kept_clock(const std::string& data, int64_t wall_ms, bool accept);
// Reads the database, every record and every blob of a folder that no coordinator uses; sets damaged blobs
// aside.
DoctorStep look_at_store(const std::string& data);
DoctorStep look_at_backup(const std::string& folder);  // whether it is whole, and the same

// Runs the steps in order up to the first that fails; reports each when it is done.
std::vector<DoctorStep> run_doctor(const DoctorPlan& plan,
                                   const std::function<void(const DoctorStep&)>& on_step);

}  // namespace kiln

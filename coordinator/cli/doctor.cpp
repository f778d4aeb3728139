#include <cstdio>
#include <cstdlib>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/doctor_steps.h"

namespace kiln {
namespace {

std::string or_variable(const Arguments& a, const std::string& option, const char* variable) {
  const char* value = std::getenv(variable);
  return a.get(option, value ? value : "");
}

Expected<DoctorPlan> plan_of(const Arguments& a) {
  DoctorPlan plan;
  plan.server = or_variable(a, "server", "KILN_SERVER");
  plan.data = a.get("data");
  plan.authority = a.get("authority");
  plan.accept_clock = a.has("accept-clock");
  plan.deep = a.has("deep");
  plan.backup = a.get("backup");
  if ((plan.accept_clock || plan.deep) && plan.data.empty())
    return fail(ErrorKind::kUsage, "--accept-clock and --deep need --data DIR, a coordinator's folder");
  plan.worker = a.has("worker");
  plan.worker_program = worker_program();
  plan.tls = {or_variable(a, "ca", "KILN_CA"), or_variable(a, "certificate", "KILN_CERTIFICATE"),
              or_variable(a, "key", "KILN_KEY")};
  const int given = !plan.tls.ca.empty() + !plan.tls.certificate.empty() + !plan.tls.key.empty();
  if (given != 0 && given != 3) return fail(ErrorKind::kUsage, "--ca, --certificate and --key go together");
  plan.token = or_variable(a, "token", "KILN_TOKEN");
  if (const std::string file = or_variable(a, "token-file", "KILN_TOKEN_FILE"); !file.empty()) {
    KILN_TRY(const Bytes bytes, read_file(file, 4096));
    plan.token.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    plan.token.erase(plan.token.find_last_not_of(" \t\r\n") + 1);
  }
  return plan;
}

int run(const Arguments& a, const BakeSettings&) {
  const auto plan = plan_of(a);
  if (!plan) return report_error(plan.error());
  const bool json = a.has("json");
  const auto steps = run_doctor(*plan, [&](const DoctorStep& step) {
    if (json) return;
    std::printf("%-4s  %-14s  %s\n", step.good ? "ok" : "FAIL", step.name.c_str(), step.finding.c_str());
    if (!step.good) std::printf("      what to do:     %s\n", step.remedy.c_str());
    std::fflush(stdout);
  });
  const bool all = !steps.empty() && steps.back().good;
  if (json) {
    JsonWriter w;
    w.begin_object().pair("ok", all).key("steps").begin_array();
    for (const DoctorStep& step : steps) {
      w.begin_object().pair("step", step.name).pair("ok", step.good).pair("finding", step.finding);
      if (!step.good) w.pair("remedy", step.remedy);
      w.end_object();
    }
    std::fputs(w.end_array().end_object().take().c_str(), stdout);
  }
  return all ? 0 : 1;
}

}  // namespace

Command doctor_command() {
  return {
      "doctor",
      "Diagnose the connection to a coordinator: print the first check that fails and how to fix it",
      "kiln doctor --server render1:7800 --token-file submit.token\n"
      "  kiln doctor --server render1:7800 --worker --ca ca.pem --certificate cert.pem --key key.pem\n"
      "  kiln doctor --data /srv/kiln",
      {{"--server", "HOST:PORT", "the coordinator (KILN_SERVER); without it only this machine is checked"},
       {"--token-file", "FILE", "its token (KILN_TOKEN_FILE, or the token in KILN_TOKEN)"},
       {"--ca", "FILE", "PEM: the authority that signed its certificate (KILN_CA)"},
       {"--certificate", "FILE", "PEM: this side's certificate (KILN_CERTIFICATE)"},
       {"--key", "FILE", "PEM: the key of that certificate (KILN_KEY)"},
       {"--data", "DIR", "a coordinator's data folder on this machine"},
       {"--authority", "FOLDER",
        "folder made by `kiln cert ca`: whether the coordinator knows what was revoked there"},
       {"--accept-clock", "",
        "with --data: this machine's clock is right, though it leapt; the coordinator deletes old jobs "
        "again"},
       {"--deep", "",
        "with --data, no coordinator running: read the database and every stored byte; sets damaged files "
        "aside"},
       {"--backup", "DIR", "a folder that `kiln backup` made: read all of it"},
       {"--worker", "", "connect as a worker does, and check the numeric class"},
       {"--json", "", "print the checks as JSON"}},
      false,
      run};
}

}  // namespace kiln

#include "coordinator/cli/doctor_steps.h"

#include <sys/resource.h>

#include <charconv>
#include <cstdio>
#include <ctime>
#include <filesystem>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/release.h"
#include "common/tls/revocation.h"
#include "common/wire/listener.h"
#include "coordinator/cli/doctor_server.h"

namespace kiln {
namespace {

constexpr int64_t kMaxClockMs = 60'000;  // certificates and tokens are dated
constexpr uint64_t kMinFree = uint64_t{1} << 30;
constexpr uint64_t kMinFiles = 1024, kMinMemoryMiB = 1024;

DoctorStep good(std::string name, std::string finding) {
  return {std::move(name), std::move(finding), true, {}};
}
DoctorStep bad(std::string name, std::string finding, std::string remedy) {
  return {std::move(name), std::move(finding), false, std::move(remedy)};
}

std::string days_left(int64_t not_after) {
  return text("until {} ({} days)", date_text(not_after),
              (not_after - static_cast<int64_t>(std::time(nullptr))) / 86400);
}

// The number after "key": in a document of the coordinator.
std::optional<int64_t> number_of(const std::string& document, const std::string& key) {
  size_t at = document.find("\"" + key + "\":");
  if (at == document.npos) return std::nullopt;
  at = document.find_first_not_of(' ', at + key.size() + 3);
  if (at == document.npos) return std::nullopt;
  int64_t value = 0;
  const auto [stop, code] = std::from_chars(document.data() + at, document.data() + document.size(), value);
  return code == std::errc() ? std::optional(value) : std::nullopt;
}

DoctorStep look_at_name(const std::string& host) {
  const auto name = resolve_name(host);
  if (!name)
    return bad("name", text("{} does not resolve: {}", host, name.error().message),
               "check its spelling, /etc/hosts and the name server, or give the address in numbers");
  return good("name", name->first == host
                          ? text("{} is an address", host)
                          : text("{} is {}{}", host, name->first,
                                 name->count > 1 ? text(" and {} more", name->count - 1) : ""));
}

DoctorStep look_at_port(const std::string& host, uint16_t port) {
  const Reached reached = reach_port(host, port, 5000);
  switch (reached.how) {
    case Reach::kOpen:
      return good("port", text("{} is open, {:.1f} ms away", port, reached.ms));
    case Reach::kRefused:
      return bad(
          "port", text("{} is refused: the machine is up, but nothing listens", port),
          "start the coordinator (kiln serve --listen HOST:PORT), on an address that others reach: not "
          "127.0.0.1; or ask for its port");
    case Reach::kNoAnswer:
      return bad("port", text("{} does not answer within 5 s", port),
                 "the machine is off, or a firewall drops the packets: open the port for this machine");
    case Reach::kNoRoute:
      return bad("port", text("{} cannot be reached: {}", port, reached.words),
                 "there is no route, or a firewall rejects it: check the network, its routes and the VPN");
    case Reach::kOther:
      break;
  }
  return bad("port", text("{}: {}", port, reached.words),
             "check the address and the network of this machine");
}

DoctorStep look_at_certificate(const DoctorPlan& plan) {
  const auto context = TlsContext::load(plan.tls);
  if (!context)
    return bad("certificate", context.error().message, "`kiln cert show FILE` prints dates, roles and hosts");
  const PeerIdentity& own = (*context)->own().identity;
  const bool fits = plan.worker ? own.has(Role::kWorker)
                                : own.has(Role::kRead) || own.has(Role::kSubmit) || own.has(Role::kAdmin);
  if (!fits)
    return bad("certificate", text("{} has the roles {}", own.name, role_list(own.roles)),
               plan.worker ? "a worker's has the role worker: kiln cert issue --role worker --name NAME"
                           : "a person's has read, submit or admin; for a worker's give --worker");
  return good("certificate", text("{}, {}, {}", own.name, role_list(own.roles), days_left(own.not_after)));
}

// `lists` and `serials`: what the coordinator has read.
DoctorStep look_at_revocations(const DoctorPlan& plan, int64_t lists, int64_t serials) {
  const std::string remedy =
      "start it with --authority FOLDER, the one that `kiln cert revoke` writes, or copy that folder's file "
      "`revoked` beside its --ca after each revocation";
  if (lists == 0) return bad("revocations", "the coordinator reads no list of revoked certificates", remedy);
  if (plan.authority.empty())
    return good("revocations", text("the coordinator knows of {} (--authority compares)", serials));
  const std::filesystem::path file = std::filesystem::path(plan.authority) / "revoked";
  const auto bytes = read_file(file, 16 << 20);
  if (!bytes) return bad("revocations", bytes.error().message, "give the folder that `kiln cert ca` made");
  const auto listed = parse_revoked({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!listed) return bad("revocations", text("{}: {}", file.string(), listed.error().message), "mend it");
  if (static_cast<int64_t>(listed->size()) > serials)
    return bad(
        "revocations",
        text("the coordinator's list is older: it has {}, {} has {}", serials, file.string(), listed->size()),
        remedy);
  return good("revocations", text("the coordinator knows all {} of {}", listed->size(), file.string()));
}

bool mentions(const std::string& words, const char* what) {
  return words.find(what) != words.npos;
}

// The outcome of the handshake decides which step failed.
std::vector<DoctorStep> look_at_greeting(const DoctorPlan& plan, const Greeting& g) {
  if (g.end == Greeting::kNothing) {
    const bool tls = mentions(g.words, "TLS") || mentions(g.words, "plain");
    const bool certificate = mentions(g.words, "certificate") || mentions(g.words, "authority");
    if (tls && !plan.tls.ca.empty() && mentions(g.words, "speaks plain"))
      return {bad("protocol", g.words,
                  "leave --ca, --certificate and --key out, or give the coordinator its own")};
    if (certificate) return {bad("hand-shake", g.words, "`kiln cert show FILE` on both machines")};
    return {bad("protocol", text("the port is open and does not speak Kiln's protocol: {}", g.words),
                tls ? "give --ca, --certificate and --key"
                    : "another program has the port: ask for the coordinator's")};
  }
  std::vector<DoctorStep> steps{good("protocol", "the port speaks Kiln's protocol")};
  if (g.end == Greeting::kRefused) {
    if (mentions(g.words, "speaks TLS") || mentions(g.words, "speaks plain"))
      return {bad("protocol", g.words, "a certificate on both sides or on none: --ca, --certificate, --key")};
    const bool version =
        mentions(g.words, "version") || mentions(g.words, "release") || mentions(g.words, "protocol");
    steps.push_back(bad(version                      ? "version"
                        : mentions(g.words, "token") ? "token"
                                                     : "admission",
                        g.words,
                        version ? "install the same release on both machines"
                                : "the coordinator keeps its tokens in its data folder; give the file with "
                                  "--token-file, and --worker for a worker's"));
    return steps;
  }
  if (g.certificate_until > 0)
    steps.push_back(good("coordinator's certificate", days_left(g.certificate_until)));
  if (!g.release.empty())
    steps.push_back(good("version", g.release == release_number() ? text("{} on both sides", g.release)
                                                                  : text("{} there, {} here: compatible",
                                                                         g.release, release_number())));
  steps.push_back(good("admission", text("welcome as {}", g.role)));
  if (plan.worker) return steps;
  const auto theirs = number_of(g.document, "now_ms");
  if (!theirs) {
    steps.push_back(good("clock", g.status_error.empty()
                                      ? "the coordinator does not tell its time: not compared"
                                      : text("not compared: {}", g.status_error)));
    return steps;
  }
  const int64_t off = *theirs - (g.asked_ms + g.answered_ms) / 2;
  const std::string finding = text("the coordinator's is {:.1f} s {} this one's", std::abs(off) / 1000.0,
                                   off < 0 ? "behind" : "ahead of");
  steps.push_back(std::abs(off) <= kMaxClockMs
                      ? good("clock", finding)
                      : bad("clock", finding, "set both clocks by NTP: certificates and tokens are dated"));
  if (const auto lists = number_of(g.document, "revoked_lists"))
    steps.push_back(look_at_revocations(plan, *lists, number_of(g.document, "revoked_serials").value_or(0)));
  const auto status = parse_json(g.document);
  const JsonValue* doubt = status ? status->find("clock_doubt") : nullptr;
  if (steps.back().good && doubt && !doubt->text.empty())
    steps.push_back(bad("retention", doubt->text, "set the coordinator's clock, or accept it as it says"));
  return steps;
}

DoctorStep look_at_class(const DoctorPlan& plan) {
  FILE* worker = ::popen(text("'{}' --canary avx2 2>&1", plan.worker_program).c_str(), "r");
  std::string words;
  char line[512];
  while (worker && std::fgets(line, sizeof line, worker)) words += line;
  const int status = worker ? ::pclose(worker) : -1;
  while (!words.empty() && words.back() == '\n') words.pop_back();
  if (status == 0)
    return good("numeric class", text("{} (jobs of other machines must state the same)", words));
  return bad(
      "numeric class", text("{} --canary avx2: {}", plan.worker_program, words.empty() ? "no answer" : words),
      "this machine cannot bake jobs for AVX2: give them --isa sse4.2, or put kiln-worker beside kiln");
}

DoctorStep look_at_data(const std::string& folder) {
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code))
    return bad("data folder", text("{} is not a folder", folder), "make it: kiln serve --data makes it too");
  if (const Status s = prepare_output_folder(folder, kMinFree); !s)
    return bad("data folder", s.error().message,
               "give the coordinator's user the folder, and a gigabyte at least");
  if (const auto mode = std::filesystem::status(folder, code).permissions();
      (mode & (std::filesystem::perms::group_all | std::filesystem::perms::others_all)) !=
      std::filesystem::perms::none)
    return bad("data folder", text("others may look into it: its mode is {:o}", static_cast<unsigned>(mode)),
               "it holds scenes, results and tokens: chmod 700 it, as kiln serve does at its start");
  return good("data folder",
              text("can be written, {:.1f} GiB free",
                   static_cast<double>(std::filesystem::space(folder, code).available) / (1u << 30)));
}

DoctorStep look_at_machine(const DoctorPlan& plan) {
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  if (files.rlim_cur < kMinFiles)
    return bad("limits", text("{} files may be open", files.rlim_cur),
               "a connection each, chunks and logs: ulimit -n 4096, or LimitNOFILE= of the unit");
  uint64_t memory = 0;
  if (FILE* info = std::fopen("/proc/meminfo", "r")) {
    char line[256];
    unsigned long long kib = 0;
    while (std::fgets(line, sizeof line, info))
      if (std::sscanf(line, "MemAvailable: %llu", &kib) == 1) memory = kib >> 10;
    std::fclose(info);
  }
  const std::string finding = text("{} files may be open, {} MiB of memory are free", files.rlim_cur, memory);
  if (plan.worker && memory > 0 && memory < kMinMemoryMiB)
    return bad("limits", finding,
               "a worker keeps scenes in memory: free a gigabyte, or take another machine");
  return good("limits", finding);
}

}  // namespace

std::vector<DoctorStep> run_doctor(const DoctorPlan& plan,
                                   const std::function<void(const DoctorStep&)>& on_step) {
  std::vector<DoctorStep> done;
  const auto add = [&](DoctorStep step) {
    on_step(step);
    done.push_back(std::move(step));
    return done.back().good;
  };
  if (!plan.server.empty()) {
    const auto address = parse_address(plan.server);
    if (!address)
      return add(bad("address", address.error().message, "kiln doctor --server render1:7800")), done;
    if (!plan.tls.ca.empty() && !add(look_at_certificate(plan))) return done;
    if (!add(look_at_name(address->first)) || !add(look_at_port(address->first, address->second)))
      return done;
    for (DoctorStep& step : look_at_greeting(plan, greet_server(plan, address->first, address->second)))
      if (!add(std::move(step))) return done;
  }
  if (!plan.backup.empty() && !add(look_at_backup(plan.backup))) return done;
  if (!plan.data.empty() &&
      (!add(look_at_data(plan.data)) ||
       !add(look_at_kept_clock(plan.data, int64_t{std::time(nullptr)} * 1000, plan.accept_clock)) ||
       (plan.deep && !add(look_at_store(plan.data)))))
    return done;
  if ((plan.worker || plan.server.empty()) && !add(look_at_class(plan))) return done;
  add(look_at_machine(plan));
  return done;
}

}  // namespace kiln

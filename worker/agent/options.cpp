#include "worker/agent/options.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>

#include "common/base/fields.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/base/release.h"
#include "common/wire/limits.h"
#include "common/wire/listener.h"

namespace kiln {
namespace {

constexpr const char* kHelp = R"(kiln-worker: bakes units of a lightmap for a Kiln coordinator.

usage: kiln-worker --connect HOST:PORT [options]
       kiln-worker --replay FILE
       kiln-worker --play FILE
       kiln-worker --canary ISA

the coordinator
  --connect HOST:PORT   its address                                             KILN_CONNECT
  --token-file FILE     file with its token (or the token in KILN_TOKEN)        KILN_TOKEN_FILE
  --ca FILE             PEM: the authority that signed its certificate          KILN_CA
  --certificate FILE    PEM: this worker's certificate                          KILN_CERTIFICATE
  --key FILE            PEM: the key of that certificate                        KILN_KEY
                        (all three or none; with them the connection is TLS)
  --patience S          seconds without a coordinator before giving up;         KILN_PATIENCE
                        default 600

this machine
  --name NAME           display name; default: the machine's name               KILN_NAME
  --threads N           concurrent units; default: all cores                    KILN_THREADS
  --memory MiB          for ready scenes and their chunks; default: half of     KILN_MEMORY
                        the machine's or the control group's memory
  --cache DIR           folder for scene chunks, shared by the workers of this  KILN_CACHE
                        machine; "off": no cache; default:
                        $XDG_CACHE_HOME/kiln-worker or ~/.cache/kiln-worker
  --cache-size MiB      evict least recently used chunks above; default 16384   KILN_CACHE_SIZE
  --unit-limit S        a unit that runs longer is hung: the worker reports it  KILN_UNIT_LIMIT
                        and exits with status 1, to be restarted;
                        default 3600
  --drain-limit S       time for running units to finish after SIGTERM;         KILN_DRAIN_LIMIT
                        default 60
  --drain-file FILE     the same as SIGTERM as soon as this file exists           KILN_DRAIN_FILE
  --preemption CLOUD    aws, gcp or azure: asks the cloud's metadata address      KILN_PREEMPTION
                        whether this machine will be taken away, and then
                        does the same as at SIGTERM; default: not asked
  --log text|json       format of log lines on standard error; default text     KILN_LOG
  --alive-file FILE     touched every second, for a supervisor's probe          KILN_ALIVE_FILE

  --replay FILE         bakes the unit in FILE (printed when a unit fails) from
                        the chunks in the cache that contains it, or in
                        --cache; prints digest, rays and seconds, or the error
  --record FILE         writes all that this worker and its coordinator say to    KILN_RECORD
                        each other to a new file, for a report of a bug: up
                        to 1 GiB, scene and results included, tokens not
  --play FILE           tells this machine what a recording's worker was told,
                        without a coordinator, and compares the answers:
                        status 0 if all digests are the same, 1 if not
  --canary ISA          prints this machine's numeric class for the kernels sse2,
                        sse4.2, avx, avx2 or avx512, and the engine
  --version             release and protocol
  --help                this text

Variables are at the right; the command line takes precedence. Unless a value is a path, KILN_..._FILE names
a file that contains it (KILN_TOKEN_FILE, KILN_CONNECT_FILE, KILN_NAME_FILE, ...).

examples: KILN_TOKEN=$(ssh render1 cat /etc/kiln/token) kiln-worker --connect render1:7800 --threads 16
          kiln-worker --connect render1:7800 --record bug.kilnrec    and elsewhere: kiln-worker --play bug.kilnrec

SIGTERM, SIGINT and notices of preemption: finishes running units, returns the others and exits with status 0.
exit status: 0 dismissed, 1 failed (no coordinator reachable, a unit hangs), 2 wrong usage or refused by the
coordinator
)";

tl::unexpected<Error> usage(std::string message) {
  return fail(ErrorKind::kUsage, message + " (kiln-worker --help shows an example)");
}

struct Option {
  const char* name;
  const char* variable;
  bool is_path;  // if so, there is no VARIABLE_FILE
  std::string value{};
};

class Table {
 public:
  Status read_environment();
  Status read(const std::vector<std::string>& arguments);
  const std::string& operator[](std::string_view name) const;

 private:
  Option options_[22] = {
      {"--connect", "KILN_CONNECT", false},
      {"--token", "KILN_TOKEN", false},  // a command line is readable by everyone on the machine
      {"--token-file", "", true},
      {"--ca", "KILN_CA", true},
      {"--certificate", "KILN_CERTIFICATE", true},
      {"--key", "KILN_KEY", true},
      {"--patience", "KILN_PATIENCE", false},
      {"--name", "KILN_NAME", false},
      {"--threads", "KILN_THREADS", false},
      {"--memory", "KILN_MEMORY", false},
      {"--cache", "KILN_CACHE", true},
      {"--cache-size", "KILN_CACHE_SIZE", false},
      {"--unit-limit", "KILN_UNIT_LIMIT", false},
      {"--drain-limit", "KILN_DRAIN_LIMIT", false},
      {"--drain-file", "KILN_DRAIN_FILE", true},
      {"--preemption", "KILN_PREEMPTION", false},
      {"--log", "KILN_LOG", false},
      {"--alive-file", "KILN_ALIVE_FILE", true},
      {"--record", "KILN_RECORD", true},
      {"--play", "", true},
      {"--replay", "", true},
      {"--canary", "", true},
  };
};

std::string from_environment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  return value ? value : "";
}

Expected<std::string> content_of(const std::string& file) {
  const auto bytes = read_file(file, kMaxTextBytes);
  if (!bytes) return usage(bytes.error().message);
  std::string content(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  content.erase(content.find_last_not_of(" \t\r\n") + 1);
  if (content.empty()) return usage(text("{} is empty", file));
  return content;
}

Status Table::read_environment() {
  for (Option& option : options_) {
    if (!*option.variable) continue;
    option.value = from_environment(option.variable);
    const std::string variable = text("{}_FILE", option.variable);
    const std::string file = option.is_path ? "" : from_environment(variable);
    if (file.empty()) continue;
    if (!option.value.empty())
      return usage(text("{} and {} are both set: set one of them", option.variable, variable));
    const auto content = content_of(file);
    if (!content) return fail(content.error().kind, text("{}: {}", variable, content.error().message));
    option.value = *content;
  }
  return {};
}

Status Table::read(const std::vector<std::string>& arguments) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    if (name == "--token")
      return usage("a token on the command line can be read by others: --token-file FILE");
    Option* found = nullptr;
    for (Option& option : options_)
      if (option.name == name) found = &option;
    if (!found) return usage(text("unknown option {}", argument));
    if (equals != std::string::npos)
      found->value = argument.substr(equals + 1);
    else if (++i < arguments.size())
      found->value = arguments[i];
    else
      return usage(text("{} needs a value", name));
  }
  return {};
}

const std::string& Table::operator[](std::string_view name) const {
  const Option* found = std::find_if(std::begin(options_), std::end(options_),
                                     [&](const Option& option) { return option.name == name; });
  return found->value;
}

// The option as an integer, or `otherwise` if not given.
Expected<int64_t> number(const Table& table, const std::string& name, int64_t most, int64_t otherwise) {
  const std::string& digits = table[name];
  if (digits.empty()) return otherwise;
  int64_t value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, code] = std::from_chars(digits.data(), end, value);
  if (code != std::errc() || stop != end || value < 1 || value > most)
    return usage(text("{} is \"{}\": give a whole number from 1 to {}", name, digits, most));
  return value;
}

Status read_certificates(const Table& table, TlsFiles& tls) {
  tls.ca = table["--ca"];
  tls.certificate = table["--certificate"];
  tls.key = table["--key"];
  if (tls.ca.empty() && tls.certificate.empty() && tls.key.empty()) return {};
  for (const char* name : {"--ca", "--certificate", "--key"})
    if (table[name].empty())
      return usage(text("{} is missing: --ca, --certificate and --key go together", name));
  return {};
}

std::string default_cache() {
  const std::string xdg = from_environment("XDG_CACHE_HOME"), home = from_environment("HOME");
  if (!xdg.empty()) return xdg + "/kiln-worker";
  return home.empty() ? "" : home + "/.cache/kiln-worker";
}

Expected<Cloud> cloud_of(const std::string& name) {
  if (name.empty()) return Cloud::kNone;
  if (name == "aws") return Cloud::kAws;
  if (name == "gcp") return Cloud::kGcp;
  if (name == "azure") return Cloud::kAzure;
  return usage(text("--preemption is \"{}\": give aws, gcp or azure", name));
}

Status read_machine(const Table& table, bool local, AgentSettings& agent) {
  agent.name = table["--name"];
  agent.alive_file = table["--alive-file"];
  agent.record = table["--record"];
  KILN_TRY(const int64_t threads, number(table, "--threads", 4096, hardware_threads()));
  agent.threads = static_cast<uint32_t>(threads);
  KILN_TRY(const int64_t patience, number(table, "--patience", 1000000, agent.patience_ms / 1000));
  agent.patience_ms = patience * 1000;
  KILN_TRY(const int64_t unit_limit, number(table, "--unit-limit", 1000000, agent.unit_limit_ms / 1000));
  agent.unit_limit_ms = unit_limit * 1000;
  KILN_TRY(const int64_t drain_limit, number(table, "--drain-limit", 1000000, agent.drain_limit_ms / 1000));
  agent.drain_limit_ms = drain_limit * 1000;
  agent.preemption.file = table["--drain-file"];
  KILN_TRY(agent.preemption.cloud, cloud_of(table["--preemption"]));
  constexpr int64_t kMaxMiB = int64_t{1} << 30;
  KILN_TRY(const int64_t memory, number(table, "--memory", kMaxMiB, 0));
  agent.memory_bytes = static_cast<uint64_t>(memory) << 20;
  KILN_TRY(const int64_t size,
           number(table, "--cache-size", kMaxMiB, static_cast<int64_t>(agent.cache_bytes >> 20)));
  agent.cache_bytes = static_cast<uint64_t>(size) << 20;
  // Local workers get their chunks over loopback, from the memory of the program that started them.
  agent.cache_folder = table["--cache"].empty() && !local ? default_cache() : table["--cache"];
  if (agent.cache_folder == "off") agent.cache_folder.clear();
  return {};
}

}  // namespace

Expected<WorkerOptions> read_worker_options(const std::vector<std::string>& arguments) {
  WorkerOptions options;
  for (const std::string& argument : arguments) {
    if (argument == "--help" || argument == "-h") options.print = kHelp;
    if (argument == "--version")
      options.print = text("kiln-worker {}, protocol {}\n", release_number(), kWireVersion);
    if (!options.print.empty()) return options;
  }
  Table table;
  KILN_TRY_STATUS(table.read_environment());
  KILN_TRY_STATUS(table.read(arguments));
  options.parent = std::atoi(from_environment("KILN_PARENT").c_str());
  AgentSettings& agent = options.agent;
  KILN_TRY_STATUS(read_machine(table, options.parent != 0, agent));
  if (const std::string& form = table["--log"]; form == "json")
    options.log = LogFormat::kJson;
  else if (!form.empty() && form != "text")
    return usage(text("--log is \"{}\": give text or json", form));
  options.canary = table["--canary"];
  if (!options.canary.empty()) return options;
  options.play = table["--play"];
  if (!options.play.empty()) return options;
  options.replay = table["--replay"];
  if (!options.replay.empty()) {  // needs no coordinator, and the file lies in the cache it is baked from
    const std::filesystem::path folder = std::filesystem::path(options.replay).parent_path();
    if (table["--cache"].empty() && folder.filename() == "replay")
      agent.cache_folder = folder.parent_path().string();
    return options;
  }

  if (table["--connect"].empty()) return usage("no coordinator given: --connect HOST:PORT");
  KILN_TRY(auto address, parse_address(table["--connect"]));
  agent.host = address.first;
  agent.port = address.second;
  KILN_TRY_STATUS(read_certificates(table, agent.tls));
  agent.token = table["--token"];
  if (const std::string& file = table["--token-file"]; !file.empty()) {
    KILN_TRY(agent.token, content_of(file));
  }
  return options;
}

}  // namespace kiln

#include "worker/agent/options.h"

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "common/base/parallel.h"
#include "common/wire/limits.h"
#include "common/wire/listener.h"

namespace kiln {
namespace {

constexpr const char* kHelp = R"(kiln-worker: bakes units of a lightmap for a Kiln coordinator.

usage: kiln-worker --connect HOST:PORT [options]

  --connect HOST:PORT   the coordinator                            (or KILN_CONNECT)
  --threads N           units baked at a time; default: all cores  (or KILN_THREADS)
  --token-file FILE     file that holds the coordinator's token    (or the token itself in KILN_TOKEN)
  --patience S          seconds without a coordinator before giving up; default 600
  --version             release and protocol
  --help                this text

example: KILN_TOKEN=$(ssh render1 cat /etc/kiln/token) kiln-worker --connect render1:7800 --threads 16

SIGTERM and SIGINT: finishes the units it has begun, hands the others back and ends with status 0.
exit status: 0 told to go, 1 failed (no coordinator to be reached), 2 wrong usage or refused by the coordinator
)";

tl::unexpected<Error> usage(std::string message) {
  return fail(ErrorKind::kUsage, message + " (kiln-worker --help shows an example)");
}

Expected<uint32_t> number(const std::string& name, const std::string& text_value, uint32_t most) {
  uint32_t value = 0;
  const char* end = text_value.data() + text_value.size();
  const auto [stop, code] = std::from_chars(text_value.data(), end, value);
  if (code != std::errc() || stop != end || value == 0 || value > most)
    return usage(text("{} is \"{}\": give a whole number from 1 to {}", name, text_value, most));
  return value;
}

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

Expected<std::string> token_of(const std::string& file) {
  if (file.empty()) return from_environment("KILN_TOKEN");
  KILN_TRY(const Bytes bytes, read_file(file, kMaxTextBytes));
  std::string token(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  token.erase(token.find_last_not_of(" \r\n") + 1);
  return token;
}

}  // namespace

Expected<WorkerOptions> read_worker_options(const std::vector<std::string>& arguments) {
  WorkerOptions options;
  std::string connect = from_environment("KILN_CONNECT"), threads = from_environment("KILN_THREADS");
  std::string patience, token_file;
  const std::pair<std::string, std::string*> known[] = {{"--connect", &connect},
                                                        {"--threads", &threads},
                                                        {"--token-file", &token_file},
                                                        {"--patience", &patience}};
  for (size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--help" || argument == "-h") options.print = kHelp;
    if (argument == "--version")
      options.print = text("kiln-worker {}, protocol {}.{}\n", KILN_VERSION, kWireMajor, kWireMinor);
    if (!options.print.empty()) return options;
    const size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    std::string* target = nullptr;
    for (const auto& [option, value] : known)
      if (option == name) target = value;
    if (!target) return usage(text("unknown option {}", argument));
    if (equals != std::string::npos)
      *target = argument.substr(equals + 1);
    else if (++i < arguments.size())
      *target = arguments[i];
    else
      return usage(text("{} needs a value", name));
  }
  if (connect.empty()) return usage("no coordinator given: --connect HOST:PORT");
  KILN_TRY(auto address, parse_address(connect));
  options.agent.host = address.first;
  options.agent.port = address.second;
  options.agent.threads = hardware_threads();
  if (!threads.empty()) {
    KILN_TRY(options.agent.threads, number("--threads", threads, 4096));
  }
  if (!patience.empty()) {
    KILN_TRY(const uint32_t seconds, number("--patience", patience, 1000000));
    options.agent.patience_ms = int64_t{seconds} * 1000;
  }
  KILN_TRY(options.agent.token, token_of(token_file));
  options.parent = std::atoi(from_environment("KILN_PARENT").c_str());
  return options;
}

bool die_with_parent(int parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  return ::getppid() == parent;  // else it ended before the call above
}

int worker_main(const std::vector<std::string>& arguments, const std::string& engine,
                const BakerFactory& make_baker, const NumericClassFunction& numeric_class) {
  log_setup("kiln-worker", LogLevel::kInfo);
  auto options = read_worker_options(arguments);
  if (!options) {
    log_error(options.error().message);
    return 2;
  }
  if (!options->print.empty()) {
    std::fputs(options->print.c_str(), stdout);
    std::fflush(stdout);
    return 0;
  }
  if (options->parent) {
    if (!die_with_parent(options->parent)) return 1;
    log_setup(text("kiln-worker {}", ::getpid()), LogLevel::kWarning);  // the coordinator tells the rest
  }
  AgentSettings& agent = options->agent;
  agent.engine = engine;
  agent.make_baker = make_baker;
  agent.numeric_class = numeric_class;
  if (const Status end = run_agent(agent); !end) {
    log_error(end.error().message);
    return exit_status(end.error());
  }
  return 0;
}

}  // namespace kiln

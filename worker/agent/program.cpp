#include "worker/agent/program.h"

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstdio>

#include "common/base/format.h"
#include "common/base/log.h"
#include "worker/agent/crash_note.h"
#include "worker/agent/options.h"
#include "worker/agent/play.h"
#include "worker/agent/replay.h"

namespace kiln {
namespace {

int print(const std::string& words) {
  std::fputs(words.c_str(), stdout);
  std::fflush(stdout);
  return 0;
}

int say_error(const Error& error) {
  log_error(error.message);
  return exit_status(error);
}

}  // namespace

bool die_with_parent(int parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  return ::getppid() == parent;  // else the parent ended before the call above
}

int worker_main(const std::vector<std::string>& arguments, const std::string& engine,
                const BakerFactory& make_baker, const NumericClassFunction& numeric_class,
                const ProbeBakerFactory& make_probe_baker) {
  log_setup("kiln-worker", LogLevel::kInfo);
  auto options = read_worker_options(arguments);
  if (!options) return say_error(options.error());
  if (!options->print.empty()) return print(options->print);
  log_setup("kiln-worker", LogLevel::kInfo, options->log);
  if (options->parent) {
    if (!die_with_parent(options->parent)) return 1;
    // The coordinator reports the rest.
    log_setup(text("kiln-worker {}", ::getpid()), LogLevel::kWarning, options->log);
  }
  AgentSettings& agent = options->agent;
  agent.engine = engine;
  agent.make_baker = make_baker;
  agent.make_probe_baker = make_probe_baker;
  agent.numeric_class = numeric_class;
  if (!options->canary.empty()) {
    const auto its_class = numeric_class(options->canary);
    return its_class ? print(text("{} {} {}\n", options->canary, *its_class, engine))
                     : say_error(its_class.error());
  }
  if (!options->play.empty()) {
    const auto outcome = run_play(options->play, agent);
    if (!outcome) return say_error(outcome.error());
    print(outcome->words);
    return outcome->same ? 0 : 1;
  }
  if (!options->replay.empty()) {
    const auto words = run_replay(options->replay, agent);
    return words ? print(*words) : say_error(words.error());
  }
  catch_crashes();
  if (const Status end = run_agent(agent); !end) return say_error(end.error());
  return 0;
}

}  // namespace kiln

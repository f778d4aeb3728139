#include <pthread.h>
#include <signal.h>
#include <spawn.h>

#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/command.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/viewer/view_server.h"

extern char** environ;

namespace kiln {
namespace {

void open_browser(const std::string& address) {
  std::string program = "xdg-open", argument = address;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child;
  if (::posix_spawnp(&child, "xdg-open", nullptr, nullptr, arguments, environ) != 0)
    std::fprintf(stderr, "kiln: there is no xdg-open here: open the address in a browser\n");
}

int run(const Arguments& a, const BakeSettings&) {
  ViewSettings settings;
  settings.bake = a.get("folder");
  settings.share = find_share();
  if (a.has("port")) {
    const auto port = parse_whole("--port", a.get("port"), 1, 65535);
    if (!port) return report_error(port.error());
    settings.port = static_cast<uint16_t>(*port);
  }
  // Before any thread starts: only this thread waits for signals.
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGTERM);
  ::sigaddset(&signals, SIGINT);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const auto server = ViewServer::start(settings);
  if (!server) return report_error(server.error());
  const std::string address = text("http://127.0.0.1:{}/", (*server)->port());
  std::printf("look at:  %s   (Ctrl+C ends)\n", address.c_str());
  std::fflush(stdout);
  if (a.has("open")) open_browser(address);
  int signal = 0;
  ::sigwait(&signals, &signal);
  return 0;
}

}  // namespace

Command view_command() {
  return {"view",
          "Show a baked scene with its lightmap in a browser; served to this machine only",
          "kiln view out --open",
          {{"folder", "DIR", "folder that kiln bake wrote", true},
           {"--port", "N", "port on this machine [any free one]"},
           {"--open", "", "open the page in the browser"}},
          false,
          run};
}

}  // namespace kiln

// Worker processes on this machine, with the same program and protocol as remote ones.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "coordinator/farm/dispatch/child_process.h"

namespace kiln {

struct LocalWorkerSettings {
  std::string program;
  uint32_t count = 1, threads = 1;
  std::string address;  // host:port they connect to
  std::string token;    // passed in the environment, because command lines are public
};

class LocalWorkers {
 public:
  // The children die with the thread that calls start() and poll() (see worker/main.cpp).
  static Expected<LocalWorkers> start(const LocalWorkerSettings& settings);

  // Reaps workers, restarts them after a crash with growing pauses, and forwards their log lines to standard
  // error.
  void poll(int64_t now_ms, std::vector<std::string>& events);
  bool hopeless() const;           // none runs and none will be restarted
  std::string last_words() const;  // how they ended and the last lines they wrote
  void stop();                     // SIGTERM, and SIGKILL for what still runs after a second

 private:
  struct Slot {
    ChildProcess process;
    bool running = false, given_up = false;
    uint32_t restarts = 0;
    int64_t restart_at = 0;
  };
  Status spawn(Slot& slot);
  void settle(Slot& slot, size_t number, int64_t now_ms, std::vector<std::string>& events);
  void pass_on(Slot& slot);

  LocalWorkerSettings settings_;
  std::vector<Slot> slots_;
  std::deque<std::string> last_lines_;
  std::string last_end_;
};

}  // namespace kiln

#include "coordinator/farm/dispatch/local_workers.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxRestarts = 5;  // per slot; a machine that crashes workers more often is broken
constexpr int64_t kFirstPauseMs = 100;
constexpr size_t kLastLines = 5;

}  // namespace

Expected<LocalWorkers> LocalWorkers::start(const LocalWorkerSettings& settings) {
  LocalWorkers workers;
  workers.settings_ = settings;
  workers.slots_.resize(settings.count);
  for (Slot& slot : workers.slots_) KILN_TRY_STATUS(workers.spawn(slot));
  return workers;
}

Status LocalWorkers::spawn(Slot& slot) {
  KILN_TRY(slot.process, ChildProcess::spawn({settings_.program}, {"KILN_CONNECT=" + settings_.address,
                                                                   "KILN_TOKEN=" + settings_.token,
                                                                   text("KILN_THREADS={}", settings_.threads),
                                                                   text("KILN_PARENT={}", ::getpid())}));
  slot.running = true;
  return {};
}

void LocalWorkers::pass_on(Slot& slot) {
  for (std::string& line : slot.process.read_lines()) {
    std::fprintf(stderr, "%s\n", line.c_str());
    last_lines_.push_back(std::move(line));
    if (last_lines_.size() > kLastLines) last_lines_.pop_front();
  }
}

void LocalWorkers::settle(Slot& slot, size_t number, int64_t now_ms, std::vector<std::string>& events) {
  KILN_CHECK(slot.running && number < slots_.size());
  slot.running = false;
  last_end_ = slot.process.how_it_ended();
  // 2: refused, or wrong usage, which a restart would not fix. 0: dismissed.
  const bool crash = !slot.process.exited_with(0) && !slot.process.exited_with(2);
  slot.given_up = !crash || slot.restarts >= kMaxRestarts;
  events.push_back(text("local worker process {} (slot {}) ended with {}{}", slot.process.pid(), number,
                        last_end_, slot.given_up ? "" : "; another is started"));
  slot.restart_at = now_ms + (kFirstPauseMs << slot.restarts++);
}

void LocalWorkers::poll(int64_t now_ms, std::vector<std::string>& events) {
  for (size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = slots_[i];
    if (slot.running) {
      const bool ended = !slot.process.running();
      pass_on(slot);
      if (ended) settle(slot, i, now_ms, events);
    } else if (!slot.given_up && now_ms >= slot.restart_at) {
      if (Status s = spawn(slot); !s) {
        slot.given_up = true;
        last_end_ = s.error().message;
        events.push_back(s.error().message);
      }
    }
  }
}

bool LocalWorkers::hopeless() const {
  return std::all_of(slots_.begin(), slots_.end(), [](const Slot& s) { return s.given_up && !s.running; });
}

std::string LocalWorkers::last_words() const {
  std::string words = last_end_;
  for (const std::string& line : last_lines_) words += "\n  " + line;
  return words;
}

void LocalWorkers::stop() {
  const SteadyClock clock;
  for (Slot& slot : slots_) slot.process.signal(SIGTERM);
  const int64_t patience = clock.now_ms() + 1000;
  const auto any_runs = [&] {
    bool runs = false;
    for (Slot& slot : slots_) {
      runs = slot.process.running() || runs;
      pass_on(slot);
    }
    return runs;
  };
  while (any_runs() && clock.now_ms() < patience) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  slots_.clear();  // kills the rest
}

}  // namespace kiln

// Time and order of events, as both ends of the protocol see them: the clock, what runs next and what runs
// later. An event loop is one; a simulation's queue is another, where an hour takes no time.
#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "common/wire/event_loop.h"

namespace kiln {

// As Timer: calls back once, unless set again or destroyed first.
class Alarm {
 public:
  virtual ~Alarm() = default;
  virtual void after(std::chrono::milliseconds delay, std::function<void()> handler) = 0;
  virtual void cancel() = 0;
};

class Timing {
 public:
  virtual ~Timing() = default;
  virtual int64_t now_ms() const = 0;  // never goes back
  virtual void post(std::function<void()> work) = 0;
  virtual std::unique_ptr<Alarm> alarm() = 0;
};

// On the thread of `loop`, which outlives it; post() from any thread.
std::unique_ptr<Timing> loop_timing(EventLoop& loop);

}  // namespace kiln

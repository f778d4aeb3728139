// One thread's events: sockets, timers, signals and work posted by other threads.
#pragma once

#include <chrono>
#include <functional>
#include <initializer_list>
#include <memory>

namespace kiln {

class EventLoop {
 public:
  EventLoop();
  ~EventLoop();  // handlers that have not run are destroyed
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Runs handlers on the calling thread until `done` (called after each handler) returns true.
  void run_until(const std::function<bool()>& done);
  // Runs what is ready now and returns.
  void run_ready();
  void post(std::function<void()> work);  // from any thread
  void on_signals(std::initializer_list<int> signals, std::function<void(int)> handler);

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// A one-shot timer: calls back once, unless set again or destroyed first.
class Timer {
 public:
  explicit Timer(EventLoop& loop);
  ~Timer();
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  void after(std::chrono::milliseconds delay, std::function<void()> handler);
  void cancel();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace kiln

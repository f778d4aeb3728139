// Virtual time: events in order of their time, then of their making. An hour takes as long as its events.
#pragma once

#include <map>
#include <random>
#include <set>

#include "common/wire/timing.h"

namespace kiln::sim {

class Clockwork {
 public:
  explicit Clockwork(uint64_t seed) : random_(seed) {}
  int64_t now() const { return now_; }
  void at(int64_t when, std::function<void()> what) { at(when, next_number(), std::move(what)); }
  // With a number of an earlier call: among events of one time the lower comes first.
  void at(int64_t when, uint64_t number, std::function<void()> what) {
    events_.emplace(std::pair(std::max(when, now_), number), std::move(what));
  }
  uint64_t next_number() { return ++made_; }
  bool step() {
    if (events_.empty()) return false;
    auto event = events_.extract(events_.begin());
    now_ = event.key().first;
    ++done_;
    event.mapped()();
    return true;
  }
  uint64_t done() const { return done_; }
  uint64_t draw(uint64_t below) { return below ? random_() % below : 0; }
  bool chance(double share) { return static_cast<double>(random_() >> 11) * 0x1p-53 < share; }

 private:
  std::mt19937_64 random_;
  std::map<std::pair<int64_t, uint64_t>, std::function<void()>> events_;
  int64_t now_ = 0;
  uint64_t made_ = 0, done_ = 0;
};

// The time of one process. While it is stalled its events wait, after its death none happens.
class ProcessTiming final : public Timing {
 public:
  explicit ProcessTiming(Clockwork& clock) : clock_(clock) {}
  ~ProcessTiming() override { *alive_ = false; }
  int64_t now_ms() const override { return clock_.now(); }
  void post(std::function<void()> work) override { later(0, std::move(work)); }
  std::unique_ptr<Alarm> alarm() override { return std::make_unique<ProcessAlarm>(*this); }

  void later(int64_t ms, std::function<void()> work) {
    at(clock_.now() + ms, clock_.next_number(), std::move(work));
  }
  void stall(int64_t ms) { stalled_until_ = std::max(stalled_until_, clock_.now() + ms); }
  int64_t stalled_until() const { return stalled_until_; }
  void after_each(std::function<void()> what) { after_each_ = std::move(what); }
  Clockwork& clock() { return clock_; }

 private:
  class ProcessAlarm final : public Alarm {
   public:
    explicit ProcessAlarm(ProcessTiming& timing) : timing_(timing) {}
    ~ProcessAlarm() override { cancel(); }
    void after(std::chrono::milliseconds delay, std::function<void()> handler) override {
      cancel();
      set_ = std::make_shared<bool>(true);
      timing_.later(delay.count(), [set = set_, handler = std::move(handler)] {
        if (std::exchange(*set, false)) handler();
      });
    }
    void cancel() override {
      if (set_) *set_ = false;
    }

   private:
    ProcessTiming& timing_;
    std::shared_ptr<bool> set_;
  };

  // What waits for the end of a stall keeps its order.
  void at(int64_t when, uint64_t number, std::function<void()> work) {
    clock_.at(when, number, [this, number, alive = alive_, work = std::move(work)]() mutable {
      if (!*alive) return;
      if (clock_.now() < stalled_until_) return at(stalled_until_, number, std::move(work));
      work();
      if (*alive && after_each_) after_each_();
    });
  }

  Clockwork& clock_;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  int64_t stalled_until_ = 0;
  std::function<void()> after_each_;
};

}  // namespace kiln::sim

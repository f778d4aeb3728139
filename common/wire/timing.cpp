#include "common/wire/timing.h"

#include "common/base/clock.h"

namespace kiln {
namespace {

class LoopAlarm final : public Alarm {
 public:
  explicit LoopAlarm(EventLoop& loop) : timer_(loop) {}
  void after(std::chrono::milliseconds delay, std::function<void()> handler) override {
    timer_.after(delay, std::move(handler));
  }
  void cancel() override { timer_.cancel(); }

 private:
  Timer timer_;
};

class LoopTiming final : public Timing {
 public:
  explicit LoopTiming(EventLoop& loop) : loop_(loop) {}
  int64_t now_ms() const override { return clock_.now_ms(); }
  void post(std::function<void()> work) override { loop_.post(std::move(work)); }
  std::unique_ptr<Alarm> alarm() override { return std::make_unique<LoopAlarm>(loop_); }

 private:
  EventLoop& loop_;
  SteadyClock clock_;
};

}  // namespace

std::unique_ptr<Timing> loop_timing(EventLoop& loop) {
  return std::make_unique<LoopTiming>(loop);
}

}  // namespace kiln

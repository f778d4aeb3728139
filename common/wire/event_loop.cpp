#include "common/wire/event_loop.h"

#include "common/base/check.h"
#include "common/wire/event_loop_impl.h"

namespace kiln {

EventLoop::EventLoop() : impl_(std::make_unique<Impl>()) {}
EventLoop::~EventLoop() = default;

void EventLoop::run_until(const std::function<bool()>& done) {
  impl_->context.restart();
  while (!done())
    if (impl_->context.run_one() == 0) return;
}

void EventLoop::run_ready() {
  impl_->context.restart();
  impl_->context.poll();
}

void EventLoop::post(std::function<void()> work) {
  asio::post(impl_->context, std::move(work));
}

void EventLoop::on_signals(std::initializer_list<int> signals, std::function<void(int)> handler) {
  impl_->signals = std::make_unique<asio::signal_set>(impl_->context);
  asio::error_code ignored;
  for (int s : signals) impl_->signals->add(s, ignored);
  impl_->on_signal = std::move(handler);
  impl_->wait_signal();
}

void EventLoop::Impl::wait_signal() {
  signals->async_wait([this](const asio::error_code& code, int signal) {
    if (code) return;
    on_signal(signal);
    wait_signal();
  });
}

// Shared with the pending wait, so that a handler that was already queued finds the timer gone, not freed.
struct Timer::Impl {
  explicit Impl(asio::io_context& context) : timer(context) {}
  asio::steady_timer timer;
  uint64_t round = 0;  // a wait superseded by after() or cancel() has an older round
};

Timer::Timer(EventLoop& loop) : impl_(std::make_shared<Impl>(loop.impl().context)) {}
Timer::~Timer() {
  cancel();
}

void Timer::cancel() {
  ++impl_->round;
  impl_->timer.cancel();
}

void Timer::after(std::chrono::milliseconds delay, std::function<void()> handler) {
  cancel();
  KILN_CHECK(handler != nullptr);
  impl_->timer.expires_after(delay);
  impl_->timer.async_wait(
      [impl = impl_, round = impl_->round, run = std::move(handler)](asio::error_code code) {
        if (!code && impl->round == round) run();
      });
}

}  // namespace kiln

// Internal to common/wire.
#pragma once

#include "common/wire/asio_api.h"
#include "common/wire/event_loop.h"

namespace kiln {

struct EventLoop::Impl {
  asio::io_context context{1};  // one thread runs it
  asio::executor_work_guard<asio::io_context::executor_type> guard{context.get_executor()};
  std::unique_ptr<asio::signal_set> signals;
  std::function<void(int)> on_signal;
  void wait_signal();
};

// Accepted or connected: no delay, keep-alive, not inherited by child processes.
void set_up_socket(asio::ip::tcp::socket& socket);
void close_on_exec(int fd);

}  // namespace kiln

// Ways to get a Connection: accept one or make one.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/wire/connection.h"
#include "common/wire/event_loop.h"

namespace kiln {

class Listener {
 public:
  // Port 0: any free port. Fails with the address and the reason.
  static Expected<std::unique_ptr<Listener>> open(EventLoop& loop, const std::string& host, uint16_t port,
                                                  std::function<void(std::unique_ptr<Connection>)> on_accept);
  ~Listener();
  uint16_t port() const;

 private:
  struct Impl;
  explicit Listener(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

// Calls back once, from the loop, with a connection that is not started yet. Tries every address of `host`.
void connect_to(EventLoop& loop, const std::string& host, uint16_t port, std::chrono::milliseconds patience,
                std::function<void(Expected<std::unique_ptr<Connection>>)> on_done);

// "host:port" or "[v6 address]:port".
Expected<std::pair<std::string, uint16_t>> parse_address(const std::string& text);

}  // namespace kiln

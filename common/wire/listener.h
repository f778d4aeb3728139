// Ways to get a Connection: accept one or make one.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/wire/connection.h"
#include "common/wire/event_loop.h"
#include "common/wire/tls.h"

namespace kiln {

struct ListenOptions {
  std::shared_ptr<const TlsContext> tls;  // null: plain
  // Takes connections without a certificate too, whose peer_identity() is empty: for enrolments, by join
  // token.
  bool admit_strangers = false;
  std::chrono::milliseconds handshake_deadline{10'000};
  // Hand-shakes at a time. When so many are under way, the oldest is given up for the next caller once it has
  // had `half_open_grace`: an honest one takes milliseconds.
  size_t max_half_open = 256;
  std::chrono::milliseconds half_open_grace{1'000};
  // A hand-shake that failed: the peer's address and the sentence. Without it they are logged as warnings.
  std::function<void(const std::string& peer, const std::string& reason)> on_refused;
};

class Listener {
 public:
  // Port 0: any free port. Fails with the address and the reason. With TLS, on_accept is called after the
  // hand-shake.
  static Expected<std::unique_ptr<Listener>> open(EventLoop& loop, const std::string& host, uint16_t port,
                                                  std::function<void(std::unique_ptr<Connection>)> on_accept,
                                                  ListenOptions options = {});
  ~Listener();
  uint16_t port() const;

 private:
  struct Impl;
  explicit Listener(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

// Calls back once, from the loop, with a connection that is not started yet. Tries every address of `host`.
// With `tls` the peer must be a coordinator whose certificate speaks for `host`; what the peer thinks of this
// side's certificate comes later, as the reason of on_closed (TLS 1.3 ends the client's hand-shake first).
void connect_to(EventLoop& loop, const std::string& host, uint16_t port, std::chrono::milliseconds patience,
                std::function<void(Expected<std::unique_ptr<Connection>>)> on_done,
                std::shared_ptr<const TlsContext> tls = nullptr);

// "host:port" or "[v6 address]:port".
Expected<std::pair<std::string, uint16_t>> parse_address(const std::string& text);

}  // namespace kiln

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
  // Also accepts connections without a certificate, with an empty peer_identity(): for enrolment by join
  // token.
  bool admit_strangers = false;
  std::chrono::milliseconds handshake_deadline{10'000};
  // Concurrent handshakes. When this many are in progress, the oldest is dropped for the next caller after
  // `half_open_grace`: an honest one takes milliseconds.
  size_t max_half_open = 256;
  std::chrono::milliseconds half_open_grace{1'000};
  // A failed handshake: the peer's address and the reason. If unset, failures are logged as warnings.
  std::function<void(const std::string& peer, const std::string& reason)> on_refused;
};

class Listener {
 public:
  // Port 0: any free port. Fails with the address and the reason. With TLS, on_accept is called after the
  // handshake.
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
// With `tls` the peer must be a coordinator whose certificate is valid for `host`. If the peer rejects this
// side's certificate, that arrives later, as the reason of on_closed (in TLS 1.3 the client's handshake
// finishes first).
void connect_to(EventLoop& loop, const std::string& host, uint16_t port, std::chrono::milliseconds patience,
                std::function<void(Expected<std::unique_ptr<Connection>>)> on_done,
                std::shared_ptr<const TlsContext> tls = nullptr);

// "host:port" or "[v6 address]:port".
Expected<std::pair<std::string, uint16_t>> parse_address(const std::string& text);

}  // namespace kiln

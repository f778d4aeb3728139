#include <charconv>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/connection_impl.h"
#include "common/wire/handshake.h"
#include "common/wire/listener.h"

namespace kiln {

using asio::ip::tcp;

namespace {

constexpr std::chrono::seconds kHandshakeDeadline{10};

struct Connecting : std::enable_shared_from_this<Connecting> {
  explicit Connecting(asio::io_context& context) : resolver(context), socket(context), timer(context) {}
  void finish(asio::error_code code) {
    if (done) return;
    resolver.cancel();
    if (code) {
      asio::error_code ignored;
      socket.close(ignored);
      return deliver(fail(ErrorKind::kUnavailable, text("cannot connect to {}: {}", name, code.message())));
    }
    set_up_socket(socket);
    auto connection = std::make_shared<Connection::Impl>(std::move(socket));
    if (!tls) return deliver(std::make_unique<Connection>(std::move(connection)));
    shake = std::make_shared<Handshake>(std::move(connection), tls);
    shake->call(
        host, kHandshakeDeadline,
        [self = shared_from_this()](const std::string&, Expected<std::unique_ptr<Connection>> result) {
          if (!result)
            result = fail(result.error().kind,
                          text("cannot connect to {}: {}", self->name, result.error().message));
          self->deliver(std::move(result));
        });
  }
  void time_out() {
    if (done) return;
    if (shake) return shake->give_up("the hand-shake took too long");
    finish(asio::error::timed_out);
  }
  void deliver(Expected<std::unique_ptr<Connection>> result) {
    KILN_CHECK(!done);  // it calls back once
    done = true;
    timer.cancel();
    shake.reset();
    on_result(std::move(result));
  }
  tcp::resolver resolver;
  tcp::socket socket;
  asio::steady_timer timer;
  std::shared_ptr<const TlsContext> tls;
  std::shared_ptr<Handshake> shake;
  std::string host, name;
  bool done = false;
  std::function<void(Expected<std::unique_ptr<Connection>>)> on_result;
};

}  // namespace

void connect_to(EventLoop& loop, const std::string& host, uint16_t port, std::chrono::milliseconds patience,
                std::function<void(Expected<std::unique_ptr<Connection>>)> on_done,
                std::shared_ptr<const TlsContext> tls) {
  auto state = std::make_shared<Connecting>(loop.impl().context);
  state->host = host;
  state->name = text("{}:{}", host, port);
  state->tls = std::move(tls);
  state->on_result = std::move(on_done);
  state->timer.expires_after(patience);
  state->timer.async_wait([state](asio::error_code code) {
    if (!code) state->time_out();
  });
  auto connect = [state](asio::error_code code, const auto& endpoints) {
    if (code || state->done) return state->finish(code);
    asio::async_connect(state->socket, endpoints,
                        [state](asio::error_code failed, const tcp::endpoint&) { state->finish(failed); });
  };
  // A numeric address needs no resolver, whose thread would add milliseconds to a worker's start.
  asio::error_code not_an_address;
  const auto address = asio::ip::make_address(host, not_an_address);
  if (!not_an_address)
    connect({}, std::array{tcp::endpoint(address, port)});
  else
    state->resolver.async_resolve(host, std::to_string(port), connect);
}

Expected<std::pair<std::string, uint16_t>> parse_address(const std::string& address) {
  const size_t colon = address.rfind(':');
  uint16_t port = 0;
  if (colon != std::string::npos) {
    const char* end = address.data() + address.size();
    const auto [stop, code] = std::from_chars(address.data() + colon + 1, end, port);
    if (code != std::errc() || stop != end) port = 0;
  }
  if (!port || !colon)
    return fail(ErrorKind::kUsage,
                text("\"{}\" is not an address: write host:port, as in render7:7800", address));
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return std::pair(host, port);
}

}  // namespace kiln

#include "common/wire/listener.h"

#include <fcntl.h>

#include <charconv>

#include "common/base/format.h"
#include "common/wire/connection_impl.h"

namespace kiln {

using asio::ip::tcp;

void close_on_exec(int fd) {
  ::fcntl(fd, F_SETFD, FD_CLOEXEC);
}

void set_up_socket(tcp::socket& socket) {
  asio::error_code ignored;
  close_on_exec(socket.native_handle());
  socket.set_option(tcp::no_delay(true), ignored);
  // A peer whose machine vanished says nothing: ask after 30 s of silence, give up after a minute.
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  const int idle = 30, every = 10, times = 3;
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPIDLE, &idle, sizeof idle);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPINTVL, &every, sizeof every);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPCNT, &times, sizeof times);
}

struct Listener::Impl : std::enable_shared_from_this<Listener::Impl> {
  explicit Impl(asio::io_context& context) : acceptor(context), retry(context) {}
  void accept() {
    acceptor.async_accept([self = shared_from_this()](asio::error_code code, tcp::socket socket) {
      if (!self->acceptor.is_open()) return;
      if (code) {  // out of file descriptors, most likely: let some close
        self->retry.expires_after(std::chrono::milliseconds(100));
        self->retry.async_wait([self](asio::error_code stopped) {
          if (!stopped) self->accept();
        });
        return;
      }
      set_up_socket(socket);
      self->on_accept(std::make_unique<Connection>(std::make_shared<Connection::Impl>(std::move(socket))));
      self->accept();
    });
  }
  tcp::acceptor acceptor;
  asio::steady_timer retry;
  std::function<void(std::unique_ptr<Connection>)> on_accept;
};

Listener::Listener(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Listener::~Listener() {
  asio::error_code ignored;
  impl_->acceptor.close(ignored);
  impl_->retry.cancel();
}

uint16_t Listener::port() const {
  asio::error_code ignored;
  return impl_->acceptor.local_endpoint(ignored).port();
}

Expected<std::unique_ptr<Listener>> Listener::open(
    EventLoop& loop, const std::string& host, uint16_t port,
    std::function<void(std::unique_ptr<Connection>)> on_accept) {
  auto& context = loop.impl().context;
  asio::error_code code;
  const auto found = tcp::resolver(context).resolve(host, std::to_string(port), tcp::resolver::passive, code);
  if (code || found.empty())
    return fail(ErrorKind::kUsage, text("cannot listen on {}: {}", host, code.message()));
  const tcp::endpoint endpoint = found.begin()->endpoint();
  auto impl = std::make_shared<Impl>(context);
  impl->on_accept = std::move(on_accept);
  auto& acceptor = impl->acceptor;
  acceptor.open(endpoint.protocol(), code);
  if (!code) close_on_exec(acceptor.native_handle());
  if (!code) acceptor.set_option(tcp::acceptor::reuse_address(true), code);
  if (!code) acceptor.bind(endpoint, code);
  if (!code) acceptor.listen(asio::socket_base::max_listen_connections, code);
  if (code)
    return fail(ErrorKind::kIo, text("cannot listen on {}:{}: {}; choose another port, or 0 for any free one",
                                     host, port, code.message()));
  impl->accept();
  return std::unique_ptr<Listener>(new Listener(std::move(impl)));
}

namespace {

struct Connecting : std::enable_shared_from_this<Connecting> {
  explicit Connecting(asio::io_context& context) : resolver(context), socket(context), timer(context) {}
  void finish(asio::error_code code) {
    if (done) return;
    done = true;
    timer.cancel();
    resolver.cancel();
    asio::error_code ignored;
    if (code) {
      socket.close(ignored);
      on_result(fail(ErrorKind::kUnavailable, text("cannot connect to {}: {}", name, code.message())));
      return;
    }
    set_up_socket(socket);
    on_result(std::make_unique<Connection>(std::make_shared<Connection::Impl>(std::move(socket))));
  }
  tcp::resolver resolver;
  tcp::socket socket;
  asio::steady_timer timer;
  std::string name;
  bool done = false;
  std::function<void(Expected<std::unique_ptr<Connection>>)> on_result;
};

}  // namespace

void connect_to(EventLoop& loop, const std::string& host, uint16_t port, std::chrono::milliseconds patience,
                std::function<void(Expected<std::unique_ptr<Connection>>)> on_done) {
  auto state = std::make_shared<Connecting>(loop.impl().context);
  state->name = text("{}:{}", host, port);
  state->on_result = std::move(on_done);
  state->timer.expires_after(patience);
  state->timer.async_wait([state](asio::error_code code) {
    if (!code) state->finish(asio::error::timed_out);
  });
  auto connect = [state](asio::error_code code, const auto& endpoints) {
    if (code || state->done) return state->finish(code);
    asio::async_connect(state->socket, endpoints,
                        [state](asio::error_code failed, const tcp::endpoint&) { state->finish(failed); });
  };
  // An address needs no resolver, whose thread would cost a worker milliseconds of its start.
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

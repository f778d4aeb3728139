#include "common/wire/listener.h"

#include <fcntl.h>
#include <sys/resource.h>

#include <algorithm>
#include <list>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/connection_impl.h"
#include "common/wire/handshake.h"

namespace kiln {

using asio::ip::tcp;

void close_on_exec(int fd) {
  ::fcntl(fd, F_SETFD, FD_CLOEXEC);
}

void set_up_socket(tcp::socket& socket) {
  asio::error_code ignored;
  close_on_exec(socket.native_handle());
  socket.set_option(tcp::no_delay(true), ignored);
  // A machine that vanished sends nothing: probe after 30 s of silence, give up after a minute.
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  const int idle = 30, every = 10, times = 3;
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPIDLE, &idle, sizeof idle);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPINTVL, &every, sizeof every);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_KEEPCNT, &times, sizeof times);
}

namespace {

// Callers may not use up the file descriptors: results, the store and clients' files need some too. A new
// descriptor is the lowest free number, so its value tells how many are in use.
bool takes_a_reserved_descriptor(int fd) {
  constexpr rlim_t kReserve = 64;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return false;
  return static_cast<rlim_t>(fd) >= limit.rlim_cur - std::min(kReserve, limit.rlim_cur / 4);
}

}  // namespace

struct Listener::Impl : std::enable_shared_from_this<Listener::Impl> {
  explicit Impl(asio::io_context& context) : acceptor(context), retry(context) {}
  void accept() {
    if (options.tls && half_open.size() >= options.max_half_open) return make_room();
    accepting = true;
    acceptor.async_accept([self = shared_from_this()](asio::error_code code, tcp::socket socket) {
      self->accepting = false;
      if (!self->acceptor.is_open()) return;
      if (code)
        return self->accept_after(std::chrono::milliseconds(100));  // out of file descriptors, most likely
      if (takes_a_reserved_descriptor(socket.native_handle())) {
        self->turn_away(std::move(socket));
      } else {
        set_up_socket(socket);
        self->take(std::make_shared<Connection::Impl>(std::move(socket)));
      }
      if (!self->accepting) self->accept();
    });
  }
  void accept_after(std::chrono::steady_clock::duration pause) {
    accepting = true;
    retry.expires_after(pause);
    retry.async_wait([self = shared_from_this()](asio::error_code stopped) {
      self->accepting = false;
      if (!stopped && self->acceptor.is_open()) self->accept();
    });
  }
  // Closed without a message, so that the caller retries later. Logged once a minute: all callers retry.
  void turn_away(tcp::socket socket) {
    const auto now = std::chrono::steady_clock::now();
    ++turned_away;
    asio::error_code ignored;
    socket.close(ignored);
    if (now < complain_from) return;
    complain_from = now + std::chrono::minutes(1);
    log_warning(
        text("too many connections for the limit of file descriptors: {} callers were turned away; "
             "raise it: ulimit -n, or LimitNOFILE= of systemd",
             turned_away));
  }
  void make_room() {
    KILN_CHECK(!half_open.empty());
    const auto left = half_open.front()->begun() + options.half_open_grace - std::chrono::steady_clock::now();
    if (left > left.zero()) return accept_after(left);
    const std::shared_ptr<Handshake> oldest = half_open.front();
    oldest->give_up("its hand-shake was slow and others wait");  // and out of the list
    accept();
  }
  void take(std::shared_ptr<Connection::Impl> connection) {
    if (!options.tls) return on_accept(std::make_unique<Connection>(std::move(connection)));
    const auto shake = std::make_shared<Handshake>(std::move(connection), options.tls);
    KILN_CHECK(half_open.size() < options.max_half_open);
    half_open.push_back(shake);
    shake->serve(
        options.admit_strangers, options.handshake_deadline,
        [self = shared_from_this()](const std::string& peer, Expected<std::unique_ptr<Connection>> result) {
          if (!self->acceptor.is_open()) return;
          if (result) return self->on_accept(std::move(*result));
          if (self->options.on_refused) return self->options.on_refused(peer, result.error().message);
          log_warning(text("{} is refused: {}", peer, result.error().message));
        },
        [self = shared_from_this(), key = shake.get()] {
          self->half_open.remove_if([key](const auto& other) { return other.get() == key; });
        });
  }
  void close() {
    asio::error_code ignored;
    acceptor.close(ignored);
    retry.cancel();
    const auto left = half_open;
    for (const auto& shake : left) shake->give_up("the listener closed");
    on_accept = nullptr;
  }
  tcp::acceptor acceptor;
  asio::steady_timer retry;
  bool accepting = false;  // or about to, after a pause
  uint64_t turned_away = 0;
  std::chrono::steady_clock::time_point complain_from{};
  ListenOptions options;
  std::list<std::shared_ptr<Handshake>> half_open;  // the oldest first
  std::function<void(std::unique_ptr<Connection>)> on_accept;
};

Listener::Listener(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Listener::~Listener() {
  impl_->close();
}

uint16_t Listener::port() const {
  asio::error_code ignored;
  return impl_->acceptor.local_endpoint(ignored).port();
}

Expected<std::unique_ptr<Listener>> Listener::open(EventLoop& loop, const std::string& host, uint16_t port,
                                                   std::function<void(std::unique_ptr<Connection>)> on_accept,
                                                   ListenOptions options) {
  if (options.tls && !options.tls->own().identity.has(Role::kCoordinator))
    return fail(ErrorKind::kUsage, text("cannot listen on {}:{} with the certificate of {}, whose roles are "
                                        "{}: a coordinator's is made with "
                                        "`kiln cert issue --role coordinator --host NAME`",
                                        host, port, options.tls->own().identity.name,
                                        role_list(options.tls->own().identity.roles)));
  auto& context = loop.impl().context;
  asio::error_code code;
  const auto found = tcp::resolver(context).resolve(host, std::to_string(port), tcp::resolver::passive, code);
  if (code || found.empty())
    return fail(ErrorKind::kUsage, text("cannot listen on {}: {}", host, code.message()));
  const tcp::endpoint endpoint = found.begin()->endpoint();
  auto impl = std::make_shared<Impl>(context);
  impl->on_accept = std::move(on_accept);
  impl->options = std::move(options);
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

}  // namespace kiln

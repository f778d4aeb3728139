#include "coordinator/cli/doctor_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <memory>

#include "common/base/clock.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/wire/listener.h"

namespace kiln {
namespace {

constexpr auto kPatience = std::chrono::seconds(5);

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

Expected<Addresses> look_up(const std::string& host, const std::string& port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  const int code = ::getaddrinfo(host.c_str(), port.empty() ? nullptr : port.c_str(), &hints, &found);
  if (code != 0) return fail(ErrorKind::kUnavailable, ::gai_strerror(code));
  return Addresses(found, &::freeaddrinfo);
}

int64_t unix_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace

Expected<ResolvedName> resolve_name(const std::string& host) {
  KILN_TRY(const Addresses found, look_up(host, ""));
  ResolvedName name;
  for (const addrinfo* a = found.get(); a; a = a->ai_next) {
    char number[NI_MAXHOST] = "";
    ::getnameinfo(a->ai_addr, a->ai_addrlen, number, sizeof number, nullptr, 0, NI_NUMERICHOST);
    if (name.count++ == 0) name.first = number;
  }
  return name;
}

Reached reach_port(const std::string& host, uint16_t port, int patience_ms) {
  const auto found = look_up(host, std::to_string(port));
  if (!found) return {Reach::kOther, found.error().message};
  Reached last{Reach::kOther, "no address"};
  for (const addrinfo* a = found->get(); a; a = a->ai_next) {
    const Stopwatch watch;
    const int fd = ::socket(a->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) continue;
    int code = ::connect(fd, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (code == EINPROGRESS) {
      pollfd ready{fd, POLLOUT, 0};
      socklen_t size = sizeof code;
      if (::poll(&ready, 1, patience_ms) == 1)
        ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &code, &size);
      else
        code = ETIMEDOUT;
    }
    ::close(fd);
    const Reach how = code == 0              ? Reach::kOpen
                      : code == ECONNREFUSED ? Reach::kRefused
                      : code == ETIMEDOUT    ? Reach::kNoAnswer
                      : code == EHOSTUNREACH || code == ENETUNREACH || code == EACCES || code == EPERM
                          ? Reach::kNoRoute
                          : Reach::kOther;
    last = {how, std::strerror(code), 1000 * watch.seconds()};
    if (how == Reach::kOpen) return last;
  }
  return last;
}

Greeting greet_server(const DoctorPlan& plan, const std::string& host, uint16_t port) {
  Greeting greeting;
  std::shared_ptr<const TlsContext> tls;
  if (!plan.tls.ca.empty()) {
    auto context = TlsContext::load(plan.tls);
    if (!context) return greeting.words = context.error().message, greeting;
    tls = *context;
  }
  EventLoop loop;
  Timer limit(loop);
  std::unique_ptr<Connection> connection;
  bool over = false;
  limit.after(kPatience, [&] {
    greeting.words = "no answer came within 5 s";
    over = true;
  });
  const auto on_frame = [&](const FrameHeader& header, std::span<const std::byte> payload) {
    auto message = decode(header, payload);
    if (!message) {
      greeting.words = message.error().message;
      over = true;
    } else if (const auto* refused = std::get_if<Refused>(&*message)) {
      greeting.end = Greeting::kRefused;
      greeting.words = refused->reason;
      over = true;
    } else if (std::holds_alternative<Welcome>(*message)) {
      greeting.end = Greeting::kWelcome;
      greeting.role = "worker";
      over = true;
    } else if (const auto* welcome = std::get_if<ClientWelcome>(&*message)) {
      greeting.end = Greeting::kWelcome;
      greeting.release = welcome->version;
      greeting.role = welcome->role;
      greeting.asked_ms = unix_ms();
      connection->accept_data();
      connection->send(Request{1, "status", "{}"});
    } else if (const auto* reply = std::get_if<Reply>(&*message)) {
      greeting.answered_ms = unix_ms();
      (reply->ok ? greeting.document : greeting.status_error) = reply->document;
      over = true;
    }
  };
  const auto on_connected = [&](Expected<std::unique_ptr<Connection>> connected) {
    if (!connected) {
      greeting.words = connected.error().message;
      over = true;
      return;
    }
    connection = std::move(*connected);
    greeting.certificate_until = connection->peer_identity().not_after;
    Connection::Handlers handlers;
    handlers.on_frame = on_frame;
    handlers.on_closed = [&](const std::string& reason) {
      if (!over && greeting.words.empty()) greeting.words = reason;
      over = true;
    };
    connection->start(std::move(handlers), 1 << 20);
    char name[256] = "";
    ::gethostname(name, sizeof name - 1);
    if (plan.worker) {
      Hello hello;
      hello.version = KILN_VERSION;
      hello.token = plan.token;
      hello.host = text("{} (kiln doctor)", name);
      hello.pid = static_cast<uint32_t>(::getpid());
      hello.instance = static_cast<uint64_t>(std::stoull(random_hex(7), nullptr, 16));
      connection->send(hello);
    } else {
      const char* user = ::getenv("USER");
      connection->send(ClientHello{KILN_VERSION, plan.token, user ? user : "doctor", name});
    }
  };
  connect_to(loop, host, port, kPatience, on_connected, tls);
  loop.run_until([&] { return over; });
  if (connection && greeting.end == Greeting::kWelcome) {
    bool closed = false;
    connection->send(Goodbye{"the doctor is done"});
    connection->close_after_writes("seen enough");
    limit.after(std::chrono::milliseconds(300), [&] { closed = true; });
    loop.run_until([&] { return closed || connection->queued_bytes() == 0; });
  }
  return greeting;
}

}  // namespace kiln

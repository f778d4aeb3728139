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
#include "common/base/release.h"
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

// One conversation with a server: hello, its answer, the status of its clock, goodbye.
class Call {
 public:
  explicit Call(const DoctorPlan& plan) : plan_(plan) {}

  Greeting run(const std::string& host, uint16_t port) {
    std::shared_ptr<const TlsContext> tls;
    if (!plan_.tls.ca.empty()) {
      auto context = TlsContext::load(plan_.tls);
      if (!context) return end(context.error().message), greeting_;
      tls = *context;
    }
    limit_.after(kPatience, [this] { end("no answer came within 5 s"); });
    connect_to(
        loop_, host, port, kPatience,
        [this](Expected<std::unique_ptr<Connection>> connected) {
          connected ? begin(std::move(*connected)) : end(connected.error().message);
        },
        tls);
    loop_.run_until([this] { return over_; });
    if (connection_ && greeting_.end == Greeting::kWelcome) say_goodbye();
    return greeting_;
  }

 private:
  void end(std::string words) {
    greeting_.words = std::move(words);
    over_ = true;
  }

  void begin(std::unique_ptr<Connection> connection) {
    connection_ = std::move(connection);
    greeting_.certificate_until = connection_->peer_identity().not_after;
    Connection::Handlers handlers;
    handlers.on_frame = [this](const FrameHeader& header, std::span<const std::byte> payload) {
      read(header, payload);
    };
    handlers.on_closed = [this](const std::string& reason) {
      if (!over_ && greeting_.words.empty()) greeting_.words = reason;
      over_ = true;
    };
    connection_->start(std::move(handlers), 1 << 20);
    char name[256] = "";
    ::gethostname(name, sizeof name - 1);
    if (plan_.worker) {
      Hello hello;
      hello.version = release_number();
      hello.token = plan_.token;
      hello.host = text("{} (kiln doctor)", name);
      hello.pid = static_cast<uint32_t>(::getpid());
      hello.instance = static_cast<uint64_t>(std::stoull(random_hex(7), nullptr, 16));
      connection_->send(hello);
    } else {
      const char* user = ::getenv("USER");
      connection_->send(ClientHello{release_number(), plan_.token, user ? user : "doctor", name});
    }
  }

  void read(const FrameHeader& header, std::span<const std::byte> payload) {
    const auto message = decode(header, payload);
    if (!message) {
      end(message.error().message);
    } else if (const auto* refused = std::get_if<Refused>(&*message)) {
      greeting_.end = Greeting::kRefused;
      end(refused->reason);
    } else if (std::holds_alternative<Welcome>(*message)) {
      greeting_.end = Greeting::kWelcome;
      greeting_.role = "worker";
      over_ = true;
    } else if (const auto* welcome = std::get_if<ClientWelcome>(&*message)) {
      greeting_.end = Greeting::kWelcome;
      greeting_.release = welcome->version;
      greeting_.role = welcome->role;
      greeting_.asked_ms = unix_ms();
      connection_->accept_data();
      connection_->send(Request{1, "status", "{}"});
    } else if (const auto* reply = std::get_if<Reply>(&*message)) {
      greeting_.answered_ms = unix_ms();
      (reply->ok ? greeting_.document : greeting_.status_error) = reply->document;
      over_ = true;
    }
  }

  void say_goodbye() {
    bool closed = false;
    connection_->send(Goodbye{"the doctor is done"});
    connection_->close_after_writes("seen enough");
    limit_.after(std::chrono::milliseconds(300), [&] { closed = true; });
    loop_.run_until([&] { return closed || connection_->queued_bytes() == 0; });
  }

  const DoctorPlan& plan_;
  Greeting greeting_;
  EventLoop loop_;
  Timer limit_{loop_};
  std::unique_ptr<Connection> connection_;
  bool over_ = false;
};

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
  return Call(plan).run(host, port);
}

}  // namespace kiln

#include "tests/bench/stub_peers.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <queue>
#include <random>
#include <string>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/messages.h"

namespace kiln::bench {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

namespace {

constexpr double kHeartbeatS = 1;
constexpr double kRetryS = 0.02;  // between attempts to connect

struct Peer {
  int fd = -1;
  bool connecting = false, welcome = false;
  Bytes in, out;
  uint64_t job = 0;
  std::deque<kiln::Unit> waiting;
  uint32_t running = 0;
  std::deque<double> sent;  // results that have not brought a new unit yet
};

struct Due {  // a unit that ends, a heartbeat or another attempt to connect
  double when;
  size_t peer;
  enum { kUnit, kHeartbeat, kConnect } what;
  uint64_t job = 0, lease = 0, unit = 0;
  uint32_t sites = 0;
  int fd = -1;  // of the connection that it is for
  bool operator<(const Due& other) const { return when > other.when; }
};

class Herd {
 public:
  Herd(const PeerPlan& plan, uint16_t port, int report)
      : plan_(plan),
        port_(port),
        report_(report),
        poll_(::epoll_create1(EPOLL_CLOEXEC)),
        peers_(plan.peers) {}

  PeerFigures run() {
    begun_ = steady_seconds();
    for (size_t i = 0; i < peers_.size(); ++i) connect(i);
    const double end = plan_.seconds > 0 ? begun_ + plan_.seconds : begun_ + 3600;
    std::vector<epoll_event> events(1024);
    while (!over_ && steady_seconds() < end) {
      const double pause = due_.empty() ? 0.1 : std::clamp(due_.top().when - steady_seconds(), 0.0, 0.1);
      const int count =
          ::epoll_wait(poll_, events.data(), static_cast<int>(events.size()), static_cast<int>(pause * 1000));
      for (int i = 0; i < count; ++i) on_event(events[static_cast<size_t>(i)]);
      if (drop_all_) {
        drop_all_ = false;
        dropped_at_ = steady_seconds();
        for (size_t i = 0; i < peers_.size(); ++i) drop(i);
      }
      while (!due_.empty() && due_.top().when <= steady_seconds()) {
        const Due due = due_.top();
        due_.pop();
        on_due(due);
      }
    }
    return sum_up();
  }

 private:
  void connect(size_t i) {
    Peer& peer = peers_[i];
    peer = {};
    peer.fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    KILN_CHECK(peer.fd >= 0);
    const int on = 1;
    ::setsockopt(peer.fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int done = ::connect(peer.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    peer.connecting = done != 0;
    if (done != 0 && errno != EINPROGRESS) return drop(i);
    Hello hello;
    hello.version = "farm_load";
    hello.token = "load";
    hello.host = text("peer{}", i);
    hello.pid = static_cast<uint32_t>(i + 1);
    hello.instance = i + 1;
    hello.threads = plan_.threads;
    hello.isa = "avx2";
    peer.out = encode(hello);
    watch(i, EPOLL_CTL_ADD);
    due_.push({steady_seconds() + kHeartbeatS, i, Due::kHeartbeat, 0, 0, 0, 0, peer.fd});
  }

  void drop(size_t i) {
    Peer& peer = peers_[i];
    if (peer.fd >= 0) ::close(peer.fd);
    if (peer.welcome) --welcome_;
    peer = {};
    due_.push({steady_seconds() + kRetryS, i, Due::kConnect});
  }

  void watch(size_t i, int how) {
    epoll_event event{};
    event.events = EPOLLIN | (peers_[i].out.empty() ? 0u : static_cast<uint32_t>(EPOLLOUT));
    event.data.u64 = i;
    ::epoll_ctl(poll_, how, peers_[i].fd, &event);
  }

  void send(size_t i, const Message& message) {
    Peer& peer = peers_[i];
    const bool idle = peer.out.empty();
    const Bytes frame = encode(message);
    peer.out.insert(peer.out.end(), frame.begin(), frame.end());
    if (idle) flush(i);
  }

  void flush(size_t i) {
    Peer& peer = peers_[i];
    if (peer.connecting || peer.out.empty()) return;
    const ssize_t put = ::send(peer.fd, peer.out.data(), peer.out.size(), MSG_NOSIGNAL);
    if (put < 0 && errno != EAGAIN) return;  // the read tells
    if (put > 0) peer.out.erase(peer.out.begin(), peer.out.begin() + put);
    watch(i, EPOLL_CTL_MOD);
  }

  void on_event(const epoll_event& event) {
    const size_t i = event.data.u64;
    Peer& peer = peers_[i];
    if (peer.fd < 0) return;
    if (event.events & EPOLLOUT) {
      peer.connecting = false;
      flush(i);
    }
    if (!(event.events & (EPOLLIN | EPOLLERR | EPOLLHUP))) return;
    std::byte buffer[1 << 16];
    const ssize_t got = ::recv(peer.fd, buffer, sizeof buffer, 0);
    if (got < 0 && errno == EAGAIN) return;
    if (got <= 0) return drop(i);
    peer.in.insert(peer.in.end(), buffer, buffer + got);
    size_t used = 0;
    while (peer.in.size() - used >= kFrameHeaderBytes) {
      const auto rest = std::span<const std::byte>(peer.in).subspan(used);
      const auto header = read_frame_header(rest.first<kFrameHeaderBytes>());
      KILN_CHECK(header);
      if (rest.size() < kFrameHeaderBytes + header->length) break;
      auto message = decode(*header, rest.subspan(kFrameHeaderBytes, header->length));
      KILN_CHECK(message);
      used += kFrameHeaderBytes + header->length;
      on_message(i, *message);
    }
    peer.in.erase(peer.in.begin(), peer.in.begin() + static_cast<ptrdiff_t>(used));
  }

  void on_message(size_t i, Message& message) {
    Peer& peer = peers_[i];
    if (std::holds_alternative<Welcome>(message)) return on_welcome(peer);
    if (const auto* job = std::get_if<Job>(&message)) {
      peer.job = job->spec.id;
      send(i, JobClass{peer.job, "load"});
      send(i, Credits{peer.job, plan_.credits, {}});
    } else if (auto* unit = std::get_if<kiln::Unit>(&message)) {
      on_unit(i, std::move(*unit));
    } else if (const auto* withdrawn = std::get_if<Withdraw>(&message)) {
      for (const uint64_t id : withdrawn->units)
        std::erase_if(peer.waiting, [&](const kiln::Unit& w) { return w.unit.id == id; });
    } else if (const auto* bye = std::get_if<Goodbye>(&message)) {
      over_ |= bye->reason == "the coordinator ends";
    } else if (const auto* refused = std::get_if<Refused>(&message)) {
      std::fprintf(stderr, "peer %zu is refused: %s\n", i, refused->reason.c_str());
      std::abort();
    }
  }

  void on_welcome(Peer& peer) {
    peer.welcome = true;
    ++figures_.welcomed;
    if (++welcome_ < peers_.size()) return;
    if (dropped_at_ > 0) {
      figures_.reconnected_s = steady_seconds() - dropped_at_;
    } else {
      figures_.all_welcome_s = steady_seconds() - begun_;
      if (plan_.reconnect) {
        drop_all_ = true;  // not from inside a message of one of them
        return;
      }
    }
    (void)!::write(report_, "w", 1);
  }

  void on_unit(size_t i, kiln::Unit&& unit) {
    Peer& peer = peers_[i];
    const double now = steady_seconds();
    if (figures_.units++ == 0) figures_.first_unit_at_s = now;
    if (!peer.sent.empty()) {
      if (figures_.units <= plan_.measured) latencies_.push_back(now - peer.sent.front());
      peer.sent.pop_front();
    }
    peer.waiting.push_back(std::move(unit));
    work(i);
  }

  void work(size_t i) {
    Peer& peer = peers_[i];
    while (peer.running < plan_.threads && !peer.waiting.empty()) {
      const kiln::Unit unit = std::move(peer.waiting.front());
      peer.waiting.pop_front();
      const Due due{steady_seconds() + plan_.unit_ms * length_(random_) / 1000,
                    i,
                    Due::kUnit,
                    unit.job,
                    unit.lease,
                    unit.unit.id,
                    static_cast<uint32_t>(unit.unit.sites.size()),
                    peer.fd};
      ++peer.running;
      plan_.unit_ms > 0 ? due_.push(due) : finish(due);
    }
  }

  void finish(const Due& due) {
    Peer& peer = peers_[due.peer];
    --peer.running;
    Result result{due.job, due.lease, {}, {}};
    result.result.unit = due.unit;
    result.result.site_count = due.sites;
    result.result.plane_count = plan_.planes;
    result.result.moments.assign(size_t{due.sites} * plan_.planes, 0.0);
    result.result.rays = 1000;
    result.digest = result_digest(result.result);
    send(due.peer, result);
    peer.sent.push_back(steady_seconds());
    ++figures_.results;
  }

  void on_due(const Due& due) {
    Peer& peer = peers_[due.peer];
    if (due.what == Due::kConnect) return connect(due.peer);
    if (peer.fd != due.fd) return;
    if (due.what == Due::kUnit) {
      finish(due);
      return work(due.peer);
    }
    if (peer.welcome) send(due.peer, Heartbeat{peer.running, static_cast<uint32_t>(peer.waiting.size()), 0});
    due_.push({steady_seconds() + kHeartbeatS, due.peer, Due::kHeartbeat, 0, 0, 0, 0, peer.fd});
  }

  PeerFigures sum_up() {
    std::sort(latencies_.begin(), latencies_.end());
    const auto quantile = [&](double q) {
      if (latencies_.empty()) return 0.0;
      const auto at = static_cast<size_t>(q * static_cast<double>(latencies_.size()));
      return 1000 * latencies_[std::min(at, latencies_.size() - 1)];
    };
    figures_.p50_ms = quantile(0.5);
    figures_.p99_ms = quantile(0.99);
    figures_.p999_ms = quantile(0.999);
    figures_.worst_ms = quantile(1);
    return figures_;
  }

  const PeerPlan plan_;
  const uint16_t port_;
  const int report_, poll_;
  std::vector<Peer> peers_;
  std::priority_queue<Due> due_;
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> length_{0.5, 1.5};  // else all would answer in the same breath
  std::vector<double> latencies_;
  PeerFigures figures_;
  size_t welcome_ = 0;
  double begun_ = 0, dropped_at_ = 0;
  bool over_ = false, drop_all_ = false;
};

}  // namespace

StubPeers::StubPeers(const PeerPlan& plan) {
  int down[2], up[2];
  KILN_CHECK(::pipe2(down, O_CLOEXEC) == 0 && ::pipe2(up, O_CLOEXEC) == 0);
  child_ = ::fork();
  KILN_CHECK(child_ >= 0);
  if (child_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::close(down[1]);
    ::close(up[0]);
    uint16_t port = 0;
    if (::read(down[0], &port, sizeof port) != sizeof port) std::_Exit(1);
    const PeerFigures figures = Herd(plan, port, up[1]).run();
    (void)!::write(up[1], &figures, sizeof figures);
    std::_Exit(0);
  }
  ::close(down[0]);
  ::close(up[1]);
  to_child_ = down[1];
  from_child_ = up[0];
}

StubPeers::~StubPeers() {
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  ::close(to_child_);
  ::close(from_child_);
}

void StubPeers::begin(uint16_t port) {
  KILN_CHECK(::write(to_child_, &port, sizeof port) == sizeof port);
}

void StubPeers::wait_until_welcome() {
  char letter = 0;
  KILN_CHECK(::read(from_child_, &letter, 1) == 1 && letter == 'w');
}

PeerFigures StubPeers::figures() {
  PeerFigures figures;
  // Whoever lost its connection meanwhile was welcome again: skip the letters before.
  Bytes all;
  std::byte buffer[4096];
  for (ssize_t got; (got = ::read(from_child_, buffer, sizeof buffer)) > 0;)
    all.insert(all.end(), buffer, buffer + got);
  KILN_CHECK(all.size() >= sizeof figures);
  std::memcpy(&figures, all.data() + all.size() - sizeof figures, sizeof figures);
  ::waitpid(child_, nullptr, 0);
  child_ = -1;
  return figures;
}

}  // namespace kiln::bench

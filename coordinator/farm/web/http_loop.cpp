#include "coordinator/farm/web/http_loop.h"

#include <netdb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "coordinator/farm/web/response.h"

namespace kiln {
namespace {

constexpr auto kDrainPatience = std::chrono::milliseconds(200);
constexpr auto kRefusalPatience = std::chrono::milliseconds(200);
constexpr auto kAcceptPause = std::chrono::milliseconds(100);  // without file descriptors
constexpr size_t kMaxDrained = 64 << 10;
constexpr int kMaxAtOnce = 64;  // callers accepted before the others are served again

bool would_wait(ssize_t result) {
  return result < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
}

std::string numeric_address(const sockaddr_storage& peer, socklen_t size) {
  char name[NI_MAXHOST] = "";
  const auto* address = reinterpret_cast<const sockaddr*>(&peer);
  ::getnameinfo(address, size, name, sizeof name, nullptr, 0, NI_NUMERICHOST);
  return name;
}

// Without waiting: for those who are turned away.
void say_and_close(int fd, const std::string& words) {
  const std::string bytes = write_response(plain_response(503, words));
  (void)!::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  ::close(fd);
}

}  // namespace

Expected<std::unique_ptr<HttpLoop>> HttpLoop::open(const std::string& host, uint16_t port,
                                                   const HttpLimits& limits) {
  KILN_TRY(const auto listening, open_http_port(host, port));
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake < 0) {
    ::close(listening.first);
    return fail(ErrorKind::kIo, "cannot serve HTTP: no file descriptor is left");
  }
  return std::unique_ptr<HttpLoop>(new HttpLoop(listening.first, listening.second, wake, limits));
}

HttpLoop::HttpLoop(int listener, uint16_t port, int wake, const HttpLimits& limits)
    : listener_(listener), wake_(wake), port_(port), limits_(limits) {}

void HttpLoop::start(OnRequest on_request) {
  on_request_ = std::move(on_request);
  thread_ = std::thread([this] { run(); });
}

HttpLoop::~HttpLoop() {
  stop();
  for (const auto& [id, peer] : peers_) ::close(peer.fd);
  ::close(listener_);
  ::close(wake_);
}

void HttpLoop::stop() {
  stop_ = true;
  ::eventfd_write(wake_, 1);
  if (thread_.joinable()) thread_.join();
}

void HttpLoop::reply(uint64_t connection, std::string response) {
  {
    const std::lock_guard lock(mutex_);
    replies_.emplace_back(connection, std::move(response));
  }
  ::eventfd_write(wake_, 1);
}

void HttpLoop::run() {
  std::vector<uint64_t> ready;
  while (!stop_) {
    bool callers = false;
    wait(ready, callers);
    take_replies();
    for (const uint64_t id : ready)
      if (const auto peer = peers_.find(id); peer != peers_.end()) serve(peer);
    end_late();
    if (callers) accept_callers();
  }
}

// Those that have something to do; whoever waits for its answer's words does not.
void HttpLoop::wait(std::vector<uint64_t>& ready, bool& callers) {
  const auto now = Clock::now();
  auto until = now + std::chrono::seconds(1);
  std::vector<pollfd> asked{{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
  if (now < accept_from_) {
    asked[1].fd = -1;
    until = std::min(until, accept_from_);
  }
  ready.clear();
  for (const auto& [id, peer] : peers_) {
    if (peer.state == State::kAnswering) continue;
    asked.push_back({peer.fd, static_cast<short>(peer.state == State::kWriting ? POLLOUT : POLLIN), 0});
    ready.push_back(id);
    until = std::min(until, peer.deadline);
  }
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - now);
  ::poll(asked.data(), asked.size(), static_cast<int>(std::max<int64_t>(0, left.count())));
  uint64_t woken = 0;
  if (asked[0].revents) ::eventfd_read(wake_, &woken);
  callers = asked[1].revents != 0;
  for (size_t i = 0; i < ready.size(); ++i)
    if (!asked[i + 2].revents) ready[i] = 0;
  std::erase(ready, 0u);
}

void HttpLoop::take_replies() {
  std::vector<std::pair<uint64_t, std::string>> replies;
  {
    const std::lock_guard lock(mutex_);
    replies.swap(replies_);
  }
  for (auto& [id, response] : replies)
    if (const auto peer = peers_.find(id); peer != peers_.end() && peer->second.state == State::kAnswering)
      answer(peer, std::move(response));
}

void HttpLoop::end_late() {
  const auto now = Clock::now();
  for (auto next = peers_.begin(); next != peers_.end();) {
    const auto peer = next++;
    if (peer->second.state == State::kAnswering || now < peer->second.deadline) continue;
    if (peer->second.state != State::kReading) {
      close(peer);
      continue;
    }
    answer(peer, write_response(plain_response(408, "the request took too long")));
  }
}

void HttpLoop::accept_callers() {
  for (int i = 0; i < kMaxAtOnce; ++i) {
    sockaddr_storage from{};
    socklen_t size = sizeof from;
    const int fd =
        ::accept4(listener_, reinterpret_cast<sockaddr*>(&from), &size, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
      const bool full = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
      if (full && !drop_oldest(nullptr)) accept_from_ = Clock::now() + kAcceptPause;
      return;
    }
    const std::string address = numeric_address(from, size);
    if (!make_room(address)) {
      say_and_close(fd, "too many requests are being answered: try again later");
      continue;
    }
    Peer& peer = peers_[++last_];
    peer.fd = fd;
    peer.address = address;
    peer.deadline = Clock::now() + limits_.patience;
    serve(peers_.find(last_));  // most heads are there already
  }
}

bool HttpLoop::make_room(const std::string& address) {
  const auto of_address = static_cast<size_t>(std::count_if(
      peers_.begin(), peers_.end(), [&](const auto& peer) { return peer.second.address == address; }));
  if (of_address >= limits_.per_address) return drop_oldest(&address);
  return peers_.size() < limits_.connections || drop_oldest(nullptr);
}

// Of one address, or of all. False: all are being answered.
bool HttpLoop::drop_oldest(const std::string* address) {
  const auto oldest = std::find_if(peers_.begin(), peers_.end(), [&](const auto& peer) {
    return peer.second.state != State::kAnswering && (!address || peer.second.address == *address);
  });
  if (oldest == peers_.end()) return false;
  if (oldest->second.state == State::kReading) {
    say_and_close(oldest->second.fd, "this connection gave way to newer ones: try again");
    peers_.erase(oldest);
  } else {
    close(oldest);
  }
  return true;
}

void HttpLoop::serve(Peers::iterator peer) {
  if (peer->second.state == State::kReading)
    read(peer);
  else if (peer->second.state == State::kWriting)
    write(peer);
  else if (peer->second.state == State::kDraining)
    drain(peer);
}

void HttpLoop::read(Peers::iterator peer) {
  char buffer[4096];
  for (;;) {
    const ssize_t got = ::recv(peer->second.fd, buffer, sizeof buffer, 0);
    if (would_wait(got)) return;
    if (got <= 0) return close(peer);
    auto head = peer->second.head.add({buffer, static_cast<size_t>(got)});
    if (!head) continue;
    if (!*head) return answer(peer, write_response(plain_response(head->error().status, head->error().why)));
    peer->second.state = State::kAnswering;
    return on_request_(peer->first, std::move(**head));
  }
}

void HttpLoop::answer(Peers::iterator peer, std::string response) {
  const bool asked = peer->second.state == State::kAnswering;
  peer->second.state = State::kWriting;
  peer->second.deadline =
      Clock::now() + (asked ? limits_.patience : std::min(limits_.patience, kRefusalPatience));
  peer->second.answer = std::move(response);
  write(peer);
}

void HttpLoop::write(Peers::iterator at) {
  Peer& peer = at->second;
  while (peer.done < peer.answer.size()) {
    const ssize_t put =
        ::send(peer.fd, peer.answer.data() + peer.done, peer.answer.size() - peer.done, MSG_NOSIGNAL);
    if (would_wait(put)) return;
    if (put <= 0) return close(at);
    peer.done += static_cast<size_t>(put);
  }
  // What the peer still sends is read for a moment: otherwise a reset could overtake the answer.
  ::shutdown(peer.fd, SHUT_WR);
  peer.answer = {};
  peer.done = 0;
  peer.state = State::kDraining;
  peer.deadline = Clock::now() + kDrainPatience;
  drain(at);
}

void HttpLoop::drain(Peers::iterator peer) {
  char dropped[4096];
  while (peer->second.done < kMaxDrained) {
    const ssize_t got = ::recv(peer->second.fd, dropped, sizeof dropped, 0);
    if (would_wait(got)) return;
    if (got <= 0) break;
    peer->second.done += static_cast<size_t>(got);
  }
  close(peer);
}

void HttpLoop::close(Peers::iterator peer) {
  ::close(peer->second.fd);
  peers_.erase(peer);
}

}  // namespace kiln

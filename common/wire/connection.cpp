#include "common/wire/connection.h"

#include <sys/socket.h>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/connection_impl.h"

namespace kiln {

Connection::Impl::Impl(asio::ip::tcp::socket s)
    : socket(std::move(s)),
      linger(socket.get_executor()),
      arriving(socket.get_executor()),
      leaving(socket.get_executor()) {
  asio::error_code code;
  const auto remote = socket.remote_endpoint(code);
  if (!code) {
    peer = text("{}:{}", remote.address().to_string(), remote.port());
    loopback = remote.address().is_loopback();
  }
}

void Connection::Impl::Deadline::set(Impl& owner, size_t bytes, void (Impl::*expired)()) {
  if (!owner.limits) return;
  due_ = asio::steady_timer::clock_type::now() + owner.limits->patience +
         std::chrono::milliseconds(bytes * 1000 / kSlowestBytes);
  if (!armed_ || *due_ < timer_.expiry()) arm(owner.shared_from_this(), expired);
}

void Connection::Impl::Deadline::end() {
  clear();
  timer_.cancel();
}

void Connection::Impl::Deadline::arm(std::shared_ptr<Impl> owner, void (Impl::*expired)()) {
  KILN_CHECK(due_);
  armed_ = true;
  timer_.expires_at(*due_);
  timer_.async_wait([this, owner = std::move(owner), expired](asio::error_code code) {
    if (code) return;  // ended, or armed for an earlier time
    armed_ = false;
    if (!due_) return;
    if (asio::steady_timer::clock_type::now() < *due_) return arm(owner, expired);
    (owner.get()->*expired)();
  });
}

void Connection::Impl::write_next() {
  if (writing || queue.empty() || shut_down) return;
  writing = true;
  leaving.set(*this, queue.front().size(), &Impl::on_late_reader);
  write(asio::buffer(queue.front()), [self = shared_from_this()](asio::error_code code, size_t) {
    if (self->shut_down) return;
    self->writing = false;
    self->leaving.clear();
    if (code) return self->shut(wire_words(code, self->tls ? &self->check : nullptr));
    const bool was_full = self->queued >= self->budget;
    KILN_CHECK(!self->queue.empty() && self->queued >= self->queue.front().size());
    self->queued -= self->queue.front().size();
    self->queue.pop_front();
    if (self->closing && self->queue.empty()) return self->linger_then_shut();
    self->write_next();
    if (was_full && self->queued < self->budget && self->handlers.on_room && !self->closing)
      self->handlers.on_room();
  });
}

void Connection::Impl::on_late_reader() {
  shut("the peer stopped reading");
}

// The reason is being sent: shut down writing and wait for the peer to close first.
void Connection::Impl::linger_then_shut() {
  asio::error_code ignored;
  if (!tls) {
    socket.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    return;
  }
  // As if the peer had closed its side: otherwise TLS would report what it still sends as an error.
  SSL_set_shutdown(tls->native_handle(), SSL_RECEIVED_SHUTDOWN);
  tls->async_shutdown([self = shared_from_this()](asio::error_code) {
    asio::error_code also_ignored;
    self->socket.shutdown(asio::ip::tcp::socket::shutdown_send, also_ignored);
  });
}

void Connection::Impl::report(const std::string& reason) {
  // Handlers own this connection's owner: release them before they run.
  KILN_CHECK(shut_down);
  const Handlers last = std::exchange(handlers, {});
  if (last.on_closed) last.on_closed(reason);
}

void Connection::Impl::shut(std::string reason) {
  if (shut_down) return;
  shut_down = true;
  asio::error_code ignored;
  socket.close(ignored);
  linger.cancel();
  arriving.end();
  leaving.end();
  share.reset();
  report(closing ? close_reason : reason);
}

void Connection::Impl::drain(std::function<void()> ended) {
  const auto end = [self = shared_from_this(), ended] {
    asio::error_code ignored;
    self->socket.close(ignored);
    self->linger.cancel();
    if (ended) ended();
  };
  // An end of stream that TLS has already read is not reported again.
  std::byte next{};
  if (::recv(socket.native_handle(), &next, 1, MSG_PEEK | MSG_DONTWAIT) == 0)
    return asio::post(socket.get_executor(), end);
  payload.resize(4096);
  socket.async_read_some(asio::buffer(payload), [self = shared_from_this(), end, ended = std::move(ended)](
                                                    asio::error_code code, size_t) {
    if (code)
      end();
    else
      self->drain(ended);
  });
}

void Connection::Impl::part(std::string reason, Bytes last_words, std::function<void()> ended) {
  if (shut_down) return;
  closing = shut_down = true;  // a destroyed Connection leaves the rest to this object
  arriving.end();
  leaving.end();
  share.reset();
  linger.expires_after(std::chrono::seconds(2));
  linger.async_wait([self = shared_from_this()](asio::error_code code) {
    asio::error_code ignored;
    if (!code) self->socket.close(ignored);
  });
  queue.assign(1, std::move(last_words));
  asio::async_write(socket, asio::buffer(queue.front()),
                    [self = shared_from_this()](asio::error_code, size_t) {
                      asio::error_code ignored;
                      self->socket.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
                    });
  drain(std::move(ended));
  report(reason);
}

Connection::Connection(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Connection::~Connection() {
  impl_->handlers = {};
  // Queued messages still get two seconds to be sent, without us.
  if (!impl_->closing) impl_->shut("closed");
}

void Connection::start(Handlers handlers, size_t budget) {
  KILN_CHECK(handlers.on_frame && !impl_->handlers.on_frame);
  impl_->handlers = std::move(handlers);
  impl_->budget = budget;
  impl_->read_header();
}

void Connection::send(const Message& message) {
  if (impl_->closing || impl_->shut_down) return;
  Bytes frame = encode(message);
  KILN_CHECK(frame.size() >= kFrameHeaderBytes);
  if (impl_->queued + frame.size() > kMaxQueuedBytes) {
    asio::post(impl_->socket.get_executor(), [impl = impl_] { impl->shut("the peer stopped reading"); });
    return;
  }
  impl_->queued += frame.size();
  impl_->queue.push_back(std::move(frame));
  impl_->write_next();
}

void Connection::accept_data(uint32_t max_bytes) {
  KILN_CHECK(max_bytes <= kMaxDataBytes);
  impl_->payload_limit = max_bytes;
}

void Connection::set_limits(PeerLimits limits) {
  KILN_CHECK(limits.memory && limits.patience.count() > 0);
  impl_->limits = std::move(limits);
}

size_t Connection::queued_bytes() const {
  return impl_->queued;
}

void Connection::drop_queued() {
  for (const size_t kept = impl_->writing ? 1 : 0; impl_->queue.size() > kept; impl_->queue.pop_back())
    impl_->queued -= impl_->queue.back().size();
}

void Connection::close_after_writes(std::string reason) {
  if (impl_->closing || impl_->shut_down) return;
  impl_->closing = true;
  impl_->close_reason = std::move(reason);
  impl_->linger.expires_after(std::chrono::seconds(2));
  impl_->linger.async_wait([impl = impl_](asio::error_code code) {
    if (!code) impl->shut(impl->close_reason);
  });
  if (impl_->queue.empty()) impl_->linger_then_shut();
}

std::string Connection::peer() const {
  return impl_->peer;
}
std::string Connection::caller() const {
  if (!impl_->identity.name.empty()) return impl_->identity.name;
  return impl_->peer.substr(0, impl_->peer.rfind(':'));
}
bool Connection::loopback() const {
  return impl_->loopback;
}
bool Connection::encrypted() const {
  return impl_->tls != nullptr;
}
const PeerIdentity& Connection::peer_identity() const {
  return impl_->identity;
}

}  // namespace kiln

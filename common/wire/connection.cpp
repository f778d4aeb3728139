#include "common/wire/connection.h"

#include <sys/socket.h>

#include "common/base/format.h"
#include "common/wire/connection_impl.h"

namespace kiln {

Connection::Impl::Impl(asio::ip::tcp::socket s) : socket(std::move(s)), linger(socket.get_executor()) {
  asio::error_code code;
  const auto remote = socket.remote_endpoint(code);
  if (!code) {
    peer = text("{}:{}", remote.address().to_string(), remote.port());
    loopback = remote.address().is_loopback();
  }
}

bool begins_like_tls(std::span<const std::byte> bytes) {
  // Content types 20 (change cipher spec) to 23 (application data), then a version whose major is 3.
  return bytes.size() >= 2 && bytes[0] >= std::byte{20} && bytes[0] <= std::byte{23} &&
         bytes[1] == std::byte{3};
}

void Connection::Impl::read_header() {
  read(asio::buffer(head), [self = shared_from_this()](asio::error_code code, size_t size) {
    if (self->shut_down) return;
    if (code) {
      // An alert of TLS is shorter than a frame's header.
      if (!self->tls && begins_like_tls(std::span(self->head).first(size)))
        return self->shut("the peer speaks TLS: give this side a certificate too");
      return self->on_read_error(code);
    }
    if (auto header = read_frame_header(self->head)) {
      self->header = *header;
      self->read_payload();
    } else {
      self->on_bad_header(header.error());
    }
  });
}

void Connection::Impl::on_bad_header(const Error& error) {
  if (tls || !begins_like_tls(head)) return shut(error.message);
  // A TLS client rejects any unencrypted answer; the frame is for whoever logs it.
  part("the peer speaks TLS and this side plain: give this side a certificate, or leave the peer's out",
       encode(Refused{"this side speaks plain: leave the certificate out, or give this side one"}));
}

void Connection::Impl::read_payload() {
  if (header.length > payload_limit) return shut("data came before the hand-shake");
  payload.resize(header.length);  // capped by read_frame_header
  read(asio::buffer(payload), [self = shared_from_this()](asio::error_code code, size_t) {
    if (self->shut_down) return;
    if (code) return self->on_read_error(code);
    if (auto good = check_frame_payload(self->header, self->payload); !good)
      return self->shut(good.error().message);
    // A closing connection still reads, so that the peer's last bytes do not turn our close into a reset
    // that would destroy the reason we sent.
    if (!self->closing) self->handlers.on_frame(self->header, self->payload);
    if (!self->shut_down) self->read_header();
  });
}

void Connection::Impl::on_read_error(const asio::error_code& code) {
  // After we close our side of TLS its stream reads nothing more, while the peer may still send: see
  // read_payload.
  if (closing && tls && code == asio::error::eof)
    return drain([self = shared_from_this()] { self->shut(self->close_reason); });
  shut(wire_words(code, tls ? &check : nullptr));
}

void Connection::Impl::write_next() {
  if (writing || queue.empty() || shut_down) return;
  writing = true;
  write(asio::buffer(queue.front()), [self = shared_from_this()](asio::error_code code, size_t) {
    if (self->shut_down) return;
    self->writing = false;
    if (code) return self->shut(wire_words(code, self->tls ? &self->check : nullptr));
    const bool was_full = self->queued >= self->budget;
    self->queued -= self->queue.front().size();
    self->queue.pop_front();
    if (self->closing && self->queue.empty()) return self->linger_then_shut();
    self->write_next();
    if (was_full && self->queued < self->budget && self->handlers.on_room && !self->closing)
      self->handlers.on_room();
  });
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
  const Handlers last = std::exchange(handlers, {});
  if (last.on_closed) last.on_closed(reason);
}

void Connection::Impl::shut(std::string reason) {
  if (shut_down) return;
  shut_down = true;
  asio::error_code ignored;
  socket.close(ignored);
  linger.cancel();
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
  impl_->handlers = std::move(handlers);
  impl_->budget = budget;
  impl_->read_header();
}

void Connection::send(const Message& message) {
  if (impl_->closing || impl_->shut_down) return;
  Bytes frame = encode(message);
  if (impl_->queued + frame.size() > kMaxQueuedBytes) {
    asio::post(impl_->socket.get_executor(), [impl = impl_] { impl->shut("the peer stopped reading"); });
    return;
  }
  impl_->queued += frame.size();
  impl_->queue.push_back(std::move(frame));
  impl_->write_next();
}

void Connection::accept_data() {
  impl_->payload_limit = kMaxDataBytes;
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

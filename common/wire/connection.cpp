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

void Connection::Impl::read_header() {
  asio::async_read(socket, asio::buffer(head), [self = shared_from_this()](asio::error_code code, size_t) {
    if (self->shut_down) return;
    if (code) return self->shut(code == asio::error::eof ? "the peer closed the connection" : code.message());
    if (auto header = read_frame_header(self->head)) {
      self->header = *header;
      self->read_payload();
    } else {
      self->shut(header.error().message);
    }
  });
}

void Connection::Impl::read_payload() {
  if (header.length > payload_limit) return shut("data came before the hand-shake");
  payload.resize(header.length);  // capped by read_frame_header
  asio::async_read(socket, asio::buffer(payload), [self = shared_from_this()](asio::error_code code, size_t) {
    if (self->shut_down) return;
    if (code) return self->shut(code.message());
    if (auto good = check_frame_payload(self->header, self->payload); !good)
      return self->shut(good.error().message);
    // A closing connection still reads, so that the peer's last bytes do not turn our close into a reset
    // that would destroy the reason we sent.
    if (!self->closing) self->handlers.on_frame(self->header, self->payload);
    if (!self->shut_down) self->read_header();
  });
}

void Connection::Impl::write_next() {
  if (writing || queue.empty() || shut_down) return;
  writing = true;
  asio::async_write(socket, asio::buffer(queue.front()),
                    [self = shared_from_this()](asio::error_code code, size_t) {
                      if (self->shut_down) return;
                      self->writing = false;
                      if (code) return self->shut(code.message());
                      const bool was_full = self->queued >= self->budget;
                      self->queued -= self->queue.front().size();
                      self->queue.pop_front();
                      if (self->closing && self->queue.empty()) return self->linger_then_shut();
                      self->write_next();
                      if (was_full && self->queued < self->budget && self->handlers.on_room && !self->closing)
                        self->handlers.on_room();
                    });
}

// The reason is on its way: say that nothing follows and wait for the peer to close first.
void Connection::Impl::linger_then_shut() {
  asio::error_code ignored;
  socket.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
}

void Connection::Impl::shut(std::string reason) {
  if (shut_down) return;
  shut_down = true;
  asio::error_code ignored;
  socket.close(ignored);
  linger.cancel();
  // Handlers own what owns this connection: let go of them before they run.
  const Handlers last = std::exchange(handlers, {});
  if (last.on_closed) last.on_closed(closing ? close_reason : reason);
}

Connection::Connection(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Connection::~Connection() {
  impl_->handlers = {};
  // Words that are still queued get their two seconds, without us.
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
    asio::post(impl_->socket.get_executor(),
               [impl = impl_] { impl->shut("the peer does not read what it is sent"); });
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

}  // namespace kiln

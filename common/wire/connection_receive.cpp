// A connection's reading half: frames, their limits and deadlines.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/connection_impl.h"

namespace kiln {

bool begins_like_tls(std::span<const std::byte> bytes) {
  // Content types 20 (change cipher spec) to 23 (application data), then a version whose major is 3.
  return bytes.size() >= 2 && bytes[0] >= std::byte{20} && bytes[0] <= std::byte{23} &&
         bytes[1] == std::byte{3};
}

void Connection::Impl::expect_message() {
  arriving.set(*this, header.length, &Impl::on_late_message);
}

void Connection::Impl::on_late_message() {
  shut("a message did not arrive whole in time");
}

// A connection may be silent between messages; a message that began must end.
void Connection::Impl::read_header() {
  read(asio::buffer(head), 1, [self = shared_from_this()](asio::error_code code, size_t size) {
    if (self->shut_down) return;
    if (code) return self->on_read_error(code);
    self->header = {};
    self->expect_message();
    self->on_first_bytes(size);
  });
}

void Connection::Impl::on_first_bytes(size_t size) {
  KILN_CHECK(size >= 1 && size <= head.size());
  if (size == head.size()) return on_header();
  read(asio::buffer(head) + size, head.size() - size,
       [self = shared_from_this(), size](asio::error_code code, size_t more) {
         if (self->shut_down) return;
         if (!code) return self->on_header();
         // An alert of TLS is shorter than a frame's header.
         if (!self->tls && begins_like_tls(std::span(self->head).first(size + more)))
           return self->shut("the peer speaks TLS: give this side a certificate too");
         self->on_read_error(code);
       });
}

void Connection::Impl::on_header() {
  auto read_as = read_frame_header(head);
  if (!read_as) return on_bad_header(read_as.error());
  header = *read_as;
  expect_payload();
}

void Connection::Impl::on_bad_header(const Error& error) {
  if (tls || !begins_like_tls(head)) return shut(error.message);
  // A TLS client rejects any unencrypted answer; the frame is for whoever logs it.
  part("the peer speaks TLS and this side plain: give this side a certificate, or leave the peer's out",
       encode(Refused{"this side speaks plain: leave the certificate out, or give this side one"}));
}

void Connection::Impl::expect_payload() {
  if (header.length > payload_limit)
    return shut(payload_limit == kMaxControlBytes
                    ? std::string("data came before the hand-shake")
                    : text("a message of {} bytes: this caller's may have {}", header.length, payload_limit));
  if (header.length > kUnreservedBytes) expect_message();
  payload.clear();
  arrived = 0;
  read_payload();
}

// An announced length costs nothing until its bytes arrive.
void Connection::Impl::read_payload() {
  KILN_CHECK(arrived <= header.length && payload.size() == arrived);
  if (arrived == header.length) return on_message();
  if (limits && arrived >= kUnreservedBytes && !share) return wait_for_memory();
  const size_t next = std::max<size_t>(kUnreservedBytes, arrived);  // doubles what is there
  payload.resize(std::min<size_t>(header.length, arrived + next));
  read(asio::buffer(payload) + arrived, payload.size() - arrived,
       [self = shared_from_this()](asio::error_code code, size_t size) {
         if (self->shut_down) return;
         if (code) return self->on_read_error(code);
         self->arrived += size;
         self->read_payload();
       });
}

void Connection::Impl::wait_for_memory() {
  KILN_CHECK(limits && !share && arrived < header.length);
  arriving.clear();  // waiting for others is not the peer's delay
  const auto go_on = [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (!self || self->shut_down) return;
    self->expect_message();
    asio::post(self->socket.get_executor(), [self] {
      if (!self->shut_down) self->read_payload();
    });
  };
  share = ReceiveBudget::reserve(limits->memory, limits->caller, header.length - arrived, go_on);
}

void Connection::Impl::on_message() {
  arriving.clear();
  KILN_CHECK(payload.size() == header.length);
  if (auto good = check_frame_payload(header, payload); !good) return shut(good.error().message);
  // A closing connection still reads, so that the peer's last bytes do not turn our close into a reset
  // that would destroy the reason we sent.
  if (!closing) handlers.on_frame(header, payload);
  share.reset();
  if (payload.capacity() > kUnreservedBytes) payload = Bytes();
  if (!shut_down) read_header();
}

void Connection::Impl::on_read_error(const asio::error_code& code) {
  // After we close our side of TLS its stream reads nothing more, while the peer may still send: see
  // read_payload.
  if (closing && tls && code == asio::error::eof)
    return drain([self = shared_from_this()] { self->shut(self->close_reason); });
  shut(wire_words(code, tls ? &check : nullptr));
}

}  // namespace kiln

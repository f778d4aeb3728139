#include "common/wire/handshake.h"

#include <sys/socket.h>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {

Handshake::Handshake(std::shared_ptr<Connection::Impl> connection, std::shared_ptr<const TlsContext> context)
    : connection_(std::move(connection)),
      context_(std::move(context)),
      timer_(connection_->socket.get_executor()) {}

void Handshake::start(std::chrono::milliseconds deadline, Done done, std::function<void()> ended) {
  KILN_CHECK(done && !done_);
  done_ = std::move(done);
  ended_ = std::move(ended);
  timer_.expires_after(deadline);
  timer_.async_wait([self = shared_from_this(), deadline](asio::error_code code) {
    if (!code)
      self->give_up(text("no hand-shake of TLS within {} s", static_cast<double>(deadline.count()) / 1000));
  });
  connection_->context = context_;
}

void Handshake::serve(bool admit_strangers, std::chrono::milliseconds deadline, Done done,
                      std::function<void()> ended) {
  start(deadline, std::move(done), std::move(ended));
  connection_->socket.async_wait(asio::socket_base::wait_read,
                                 [self = shared_from_this(), admit_strangers](asio::error_code code) {
                                   if (!self->done_) return;
                                   if (code) return self->refuse(wire_words(code, nullptr), {});
                                   self->look_at_first_byte(admit_strangers);
                                 });
}

// A peer without TLS gets its answer unencrypted.
void Handshake::look_at_first_byte(bool admit_strangers) {
  unsigned char first = 0;
  const ssize_t got = ::recv(connection_->socket.native_handle(), &first, 1, MSG_PEEK | MSG_DONTWAIT);
  if (got == 1 && first == (kFrameMagic & 255))
    return refuse("the peer speaks plain and this port TLS: give it a certificate (`kiln cert issue`)",
                  encode(Refused{
                      "this coordinator speaks TLS: give this side the folder that `kiln cert issue` made"}));
  connection_->tls = std::make_unique<TlsStream>(connection_->socket, context_->impl().context);
  verify_caller(*connection_->tls, *context_, admit_strangers, connection_->check);
  shake(asio::ssl::stream_base::server);
}

void Handshake::call(const std::string& host, std::chrono::milliseconds deadline, Done done) {
  start(deadline, std::move(done), {});
  connection_->tls = std::make_unique<TlsStream>(connection_->socket, context_->impl().context);
  verify_coordinator(*connection_->tls, *context_, host, connection_->check);
  shake(asio::ssl::stream_base::client);
}

void Handshake::shake(asio::ssl::stream_base::handshake_type side) {
  connection_->tls->async_handshake(side, [self = shared_from_this()](asio::error_code code) {
    if (!self->done_) return;
    if (!code) return self->finish();
    self->refuse(code == asio::error::eof || code == asio::ssl::error::stream_truncated
                     ? "the peer ended the connection within the hand-shake of TLS"
                     : wire_words(code, &self->connection_->check),
                 {});
  });
}

void Handshake::finish() {
  KILN_CHECK(connection_ && connection_->tls);
  connection_->identity = kiln::peer_identity(*connection_->tls);
  const Done done = std::exchange(done_, nullptr);
  const std::string peer = connection_->peer;
  auto connection = std::make_unique<Connection>(std::exchange(connection_, nullptr));
  end();
  done(peer, std::move(connection));
}

void Handshake::refuse(const std::string& reason, Bytes last_words) {
  KILN_CHECK(done_ && connection_);
  const Done done = std::exchange(done_, nullptr);
  const std::string peer = connection_->peer;
  // An alert is on its way: as in Connection, wait for the peer to close first.
  connection_->part(reason, std::move(last_words), [self = shared_from_this()] { self->end(); });
  done(peer, fail(ErrorKind::kUnavailable, reason));
}

void Handshake::give_up(const std::string& reason) {
  const auto self = shared_from_this();
  const Done done = std::exchange(done_, nullptr);
  std::string peer;
  if (connection_) {
    peer = connection_->peer;
    asio::error_code ignored;
    connection_->socket.close(ignored);
  }
  end();
  if (done) done(peer, fail(ErrorKind::kUnavailable, reason));
}

void Handshake::end() {
  timer_.cancel();
  if (const auto ended = std::exchange(ended_, nullptr)) ended();
}

}  // namespace kiln

#include "tests/tls/certified_peer.h"

#include "common/wire/limits.h"

namespace kiln::test {

CertifiedPeer::CertifiedPeer(uint16_t port, std::shared_ptr<const TlsContext> tls) {
  connect_to(
      loop_, "127.0.0.1", port, std::chrono::seconds(20),
      [this](Expected<std::unique_ptr<Connection>> made) {
        if (!made) {
          ended_ = made.error().message;
          return;
        }
        connection_ = std::move(*made);
        Connection::Handlers handlers;
        handlers.on_frame = [this](const FrameHeader& header, auto payload) {
          if (auto message = decode(header, payload)) messages_.push_back(std::move(*message));
        };
        handlers.on_closed = [this](const std::string& reason) { ended_ = reason; };
        connection_->accept_data();
        connection_->start(std::move(handlers), kChunkWriteBudget);
      },
      std::move(tls));
  limit_.after(std::chrono::seconds(30), [this] { late_ = true; });
  loop_.run_until([this] { return late_ || connection_ || !ended_.empty(); });
}

std::optional<Message> CertifiedPeer::receive() {
  limit_.after(std::chrono::seconds(30), [this] { late_ = true; });
  loop_.run_until([this] { return late_ || !messages_.empty() || !ended_.empty(); });
  if (messages_.empty()) return std::nullopt;
  Message first = std::move(messages_.front());
  messages_.pop_front();
  return first;
}

std::string CertifiedPeer::end() {
  limit_.after(std::chrono::seconds(30), [this] { late_ = true; });
  loop_.run_until([this] { return late_ || !ended_.empty(); });
  return ended_.empty() ? "(it goes on)" : ended_;
}

}  // namespace kiln::test

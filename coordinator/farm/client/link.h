// Internal to coordinator/farm/client: one connection and the messages received on it.
#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "common/wire/event_loop.h"
#include "common/wire/listener.h"
#include "coordinator/farm/client/service_client.h"

namespace kiln {

class ClientConnection {
 public:
  // Sends ClientHello and waits for the welcome.
  static Expected<std::unique_ptr<ClientConnection>> open(const ClientOptions& options);

  void send(const Message& message) { connection_->send(message); }
  // The next Reply or ChunkPiece. kUnavailable: the connection is lost, or nothing arrived for `patience`.
  Expected<Message> next(std::chrono::milliseconds patience);
  // Waits until less than `bytes` are queued.
  Status wait_for_room(size_t bytes, std::chrono::milliseconds patience);
  const std::string& role() const { return role_; }

 private:
  ClientConnection() : timer_(loop_) {}
  Status run(std::chrono::milliseconds patience, const std::function<bool()>& done);
  void on_frame(const FrameHeader& header, std::span<const std::byte> payload);

  EventLoop loop_;
  Timer timer_;
  std::unique_ptr<Connection> connection_;
  std::deque<Message> arrived_;
  std::optional<Error> lost_;
  std::string role_;
};

}  // namespace kiln

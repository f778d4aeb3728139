// Internal to common/wire.
#pragma once

#include <deque>

#include "common/wire/connection.h"
#include "common/wire/event_loop_impl.h"
#include "common/wire/limits.h"

namespace kiln {

struct Connection::Impl : std::enable_shared_from_this<Connection::Impl> {
  explicit Impl(asio::ip::tcp::socket s);
  void read_header();
  void read_payload();
  void write_next();
  void shut(std::string reason);  // closes the socket and reports once
  void linger_then_shut();

  asio::ip::tcp::socket socket;
  asio::steady_timer linger;
  std::string peer;
  bool loopback = false;
  Handlers handlers;
  size_t budget = 0;
  std::array<std::byte, kFrameHeaderBytes> head{};
  FrameHeader header;
  Bytes payload;
  std::deque<Bytes> queue;  // the front is being written
  size_t queued = 0;
  uint32_t payload_limit = kMaxControlBytes;
  bool writing = false, closing = false, shut_down = false;
  std::string close_reason;
};

}  // namespace kiln

// One peer: one reader and one bounded write queue, over plain TCP or TLS. Call it on the loop's thread only;
// handlers run from the loop, never from inside a call.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/limits.h"
#include "common/wire/messages.h"
#include "common/wire/receive_budget.h"

namespace kiln {

struct PeerLimits {
  // Large messages reserve their memory here, in the name of `caller`.
  std::shared_ptr<ReceiveBudget> memory;
  std::string caller;
  // What a message has to arrive or to be written, besides a second for each kSlowestBytes of it.
  std::chrono::milliseconds patience = kMessagePatience;
};

class Connection {
 public:
  struct Handlers {
    // Checksum verified. The payload is valid during the call.
    std::function<void(const FrameHeader&, std::span<const std::byte> payload)> on_frame;
    // Called once and last: the peer left, sent a damaged frame or stopped reading, or close() was called.
    std::function<void(const std::string& reason)> on_closed;
    // The queue went below `budget` bytes again (see start).
    std::function<void()> on_room;
  };

  struct Impl;
  explicit Connection(std::shared_ptr<Impl> impl);
  ~Connection();  // closes; handlers are not called any more
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Starts reading. `budget`: on_room is called each time the queue drops below it.
  void start(Handlers handlers, size_t budget);
  // Until this is called only control messages are accepted, so that a stranger cannot make us allocate more;
  // then messages of at most `max_bytes`.
  void accept_data(uint32_t max_bytes = kMaxDataBytes);
  // For the side that strangers connect to. Unset: no bounds but a message's cap.
  void set_limits(PeerLimits limits);
  // Queues a message. If more than kMaxQueuedBytes are waiting, the peer has stopped reading: closes the
  // connection.
  void send(const Message& message);
  size_t queued_bytes() const;
  // Forgets the messages that are queued, but for one that is being sent.
  void drop_queued();
  // Sends what is queued (for 2 s at most), then closes. Messages that still arrive are ignored.
  void close_after_writes(std::string reason);
  std::string peer() const;  // "address:port"
  // Who is on the other side, as far as limits are concerned: the certificate's name, or the address.
  std::string caller() const;
  bool loopback() const;
  bool encrypted() const;
  // The peer's identity from its certificate; empty without TLS, and for strangers that the listener admits.
  // The certificate was valid at the handshake; TlsContext::is_revoked tells whether it still is.
  const PeerIdentity& peer_identity() const;

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace kiln

// One peer: one reader, one bounded writer queue, over plain TCP or TLS. All calls on the loop's thread;
// handlers run from the loop, never from inside a call.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/messages.h"

namespace kiln {

class Connection {
 public:
  struct Handlers {
    // Checksum verified. The payload is valid during the call.
    std::function<void(const FrameHeader&, std::span<const std::byte> payload)> on_frame;
    // Once, after which no handler is called: the peer went, damaged a frame or did not read, or close().
    std::function<void(const std::string& reason)> on_closed;
    // The queue went below `budget` bytes again (see start).
    std::function<void()> on_room;
  };

  struct Impl;
  explicit Connection(std::shared_ptr<Impl> impl);
  ~Connection();  // closes; handlers are not called any more
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Begins to read. `budget`: on_room is called each time the queue drops below it.
  void start(Handlers handlers, size_t budget);
  // Until this is called only control messages are taken: a stranger cannot make us allocate more.
  void accept_data();
  // Queues a message. Above kMaxQueuedBytes the peer does not read: the connection is closed instead.
  void send(const Message& message);
  size_t queued_bytes() const;
  // Sends what is queued (for 2 s at most), then closes. What still arrives is not handled.
  void close_after_writes(std::string reason);
  std::string peer() const;  // "address:port"
  bool loopback() const;
  bool encrypted() const;
  // Who the peer is by the certificate that it showed; empty without TLS, and for a stranger that the
  // listener admits. The certificate was good at the hand-shake: TlsContext::is_revoked says whether it still
  // is.
  const PeerIdentity& peer_identity() const;

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace kiln

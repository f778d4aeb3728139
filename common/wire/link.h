// One peer as both ends of the protocol see it. A Connection is one; a simulation and a recording are others.
// As with Connection, handlers run from the loop, never from inside a call.
#pragma once

#include "common/wire/connection.h"

namespace kiln {

class Link {
 public:
  virtual ~Link() = default;  // closes; handlers are not called any more
  // These do what Connection's functions of the same names do.
  virtual void start(Connection::Handlers handlers, size_t budget) = 0;
  virtual void accept_data(uint32_t max_bytes) = 0;
  virtual void send(const Message& message) = 0;
  virtual size_t queued_bytes() const = 0;
  virtual void drop_queued() = 0;
  virtual void close_after_writes(std::string reason) = 0;
  virtual std::string peer() const = 0;
  virtual std::string caller() const = 0;
  virtual bool loopback() const = 0;
  virtual const PeerIdentity& peer_identity() const = 0;
};

std::unique_ptr<Link> make_link(std::unique_ptr<Connection> connection);

}  // namespace kiln

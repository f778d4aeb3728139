// People's programs on the same port as workers: who is let in, and what is done with what they say.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/messages.h"

namespace kiln {

// The farm's end of a client's connection, on the farm's thread alone.
class ClientLink {
 public:
  virtual ~ClientLink() = default;
  virtual void send(const Message& message) = 0;
  virtual size_t queued_bytes() const = 0;
  virtual const std::string& peer() const = 0;  // "address:port"
};

// What is said by one client. Called on the farm's thread: anything that takes time is done elsewhere.
class ClientTalk {
 public:
  virtual ~ClientTalk() = default;       // the connection has ended: the link is gone
  virtual std::string role() const = 0;  // for ClientWelcome
  virtual void on_request(Request request) = 0;
  virtual void on_piece(ChunkPiece piece) = 0;                // of an upload
  virtual Status on_chunk_request(ChunkRequest request) = 0;  // of a download; an error refuses the client
  virtual void on_room() = 0;                                 // less than kChunkWriteBudget is queued again
};

struct ClientPort {
  // Without TLS the identity is empty and the token decides; an error is told to the client.
  std::function<Expected<std::unique_ptr<ClientTalk>>(const ClientHello&, const PeerIdentity&, ClientLink&)>
      admit;
};

}  // namespace kiln

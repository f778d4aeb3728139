// Clients on the workers' port: admission and handling of their messages.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/messages.h"

namespace kiln {

// The farm's end of a client's connection; farm thread only.
class ClientLink {
 public:
  virtual ~ClientLink() = default;
  virtual void send(const Message& message) = 0;
  virtual size_t queued_bytes() const = 0;
  virtual const std::string& peer() const = 0;  // "address:port"
};

// Handles one client's messages. Called on the farm's thread, so slow work must run elsewhere.
class ClientTalk {
 public:
  virtual ~ClientTalk() = default;                 // the connection has ended and the link is invalid
  virtual std::string role() const = 0;            // for ClientWelcome
  virtual uint32_t max_message_bytes() const = 0;  // that its role has a use for
  virtual void on_request(Request request) = 0;
  virtual void on_piece(ChunkPiece piece) = 0;                // of an upload
  virtual Status on_chunk_request(ChunkRequest request) = 0;  // of a download; an error refuses the client
  virtual void on_room() = 0;                                 // less than kChunkWriteBudget is queued
};

struct ClientPort {
  // Without TLS the identity is empty and the token decides; errors are sent to the client.
  std::function<Expected<std::unique_ptr<ClientTalk>>(const ClientHello&, const PeerIdentity&, ClientLink&)>
      admit;
};

}  // namespace kiln

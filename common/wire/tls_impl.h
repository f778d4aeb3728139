// Internal to common/wire.
#pragma once

#include <optional>
#include <string>

#include "common/tls/revocation.h"
#include "common/wire/asio_api.h"
#include "common/wire/tls.h"

namespace kiln {

struct TlsContext::Impl {
  explicit Impl(const std::vector<std::filesystem::path>& lists) : revoked(lists) {}
  asio::ssl::context context{asio::ssl::context::tls};
  Certificate own;
  RevocationLists revoked;
  std::optional<Digest> pinned;  // an enrolment's authority
};

using TlsStream = asio::ssl::stream<asio::ip::tcp::socket&>;

// Result of checking the peer's certificate in a handshake: on failure, the message.
struct PeerCheck {
  std::string failure;
};

// Makes the stream verify the peer's chain, dates, revocation and role, and on the client side that it is
// `host`. `check` outlives the stream.
void verify_coordinator(TlsStream& stream, const TlsContext& context, const std::string& host,
                        PeerCheck& check);
void verify_caller(TlsStream& stream, const TlsContext& context, bool admit_strangers, PeerCheck& check);

// The certificate that the peer presented in a successful handshake; empty if none.
PeerIdentity peer_identity(TlsStream& stream);

// The message for a socket or TLS error, from this side (`check`) or sent by the peer as an alert.
std::string wire_words(const asio::error_code& code, const PeerCheck* check);

}  // namespace kiln

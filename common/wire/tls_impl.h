// Internal to common/wire.
#pragma once

#include <optional>
#include <string>

#include "common/tls/revocation.h"
#include "common/wire/asio_api.h"
#include "common/wire/tls.h"

namespace kiln {

struct TlsContext::Impl {
  explicit Impl(const std::filesystem::path& revoked) : revoked(revoked) {}
  asio::ssl::context context{asio::ssl::context::tls};
  Certificate own;
  RevocationList revoked;
  std::optional<Digest> pinned;  // an enrolment's authority
};

using TlsStream = asio::ssl::stream<asio::ip::tcp::socket&>;

// What a hand-shake learnt about the peer's certificate: on a failure, the sentence.
struct PeerCheck {
  std::string failure;
};

// Makes the stream check the peer: its chain, dates, revocation and role, and as a client that it is `host`.
// `check` outlives the stream.
void verify_coordinator(TlsStream& stream, const TlsContext& context, const std::string& host,
                        PeerCheck& check);
void verify_caller(TlsStream& stream, const TlsContext& context, bool admit_strangers, PeerCheck& check);

// The certificate that the peer showed in a hand-shake that succeeded; empty if none.
PeerIdentity peer_identity(TlsStream& stream);

// A sentence for an error of a socket or of TLS, from this side (`check`) or told by the peer as an alert.
std::string wire_words(const asio::error_code& code, const PeerCheck* check);

}  // namespace kiln

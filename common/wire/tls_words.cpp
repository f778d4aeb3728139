// Readable connection errors: OpenSSL says "sslv3 alert bad certificate".
#include "common/base/format.h"
#include "common/wire/tls_impl.h"

namespace kiln {
namespace {

// Alerts of RFC 8446, section 6: the peer's complaint. OpenSSL adds 1000 to those that it receives.
const char* alert_words(int alert) {
  switch (alert) {
    case SSL_AD_CERTIFICATE_REQUIRED:
      return "the peer asks for a certificate: give this side the folder that `kiln cert issue` made";
    case SSL_AD_UNKNOWN_CA:
      return "the peer does not know the authority that signed this side's certificate: both sides need "
             "certificates "
             "of one authority";
    case SSL_AD_CERTIFICATE_EXPIRED:
      return "the peer finds this side's certificate expired: make a new one with `kiln cert issue`, or set "
             "its clock";
    case SSL_AD_CERTIFICATE_REVOKED:
      return "this side's certificate was revoked: ask for a new one";
    case SSL_AD_BAD_CERTIFICATE:
    case SSL_AD_UNSUPPORTED_CERTIFICATE:
    case SSL_AD_CERTIFICATE_UNKNOWN:
      return "the peer refuses this side's certificate, not valid yet or not for this use: its log says why; "
             "`kiln cert show` prints dates, roles and hosts";
    case SSL_AD_HANDSHAKE_FAILURE:
    case SSL_AD_ACCESS_DENIED:
      return "the peer refuses this side's certificate, whose roles do not fit or whose state it cannot "
             "tell: its log "
             "says why; `kiln cert show` prints the roles";
    case SSL_AD_PROTOCOL_VERSION:
      return "the peer does not speak TLS 1.3";
    default:
      return nullptr;
  }
}

std::string tls_words(const asio::error_code& code) {
  const int reason = ERR_GET_REASON(static_cast<unsigned long>(static_cast<unsigned>(code.value())));
  if (const char* words =
          reason > SSL_AD_REASON_OFFSET ? alert_words(reason - SSL_AD_REASON_OFFSET) : nullptr)
    return words;
  switch (reason) {
    case SSL_R_WRONG_VERSION_NUMBER:
    case SSL_R_HTTP_REQUEST:
    case SSL_R_PACKET_LENGTH_TOO_LONG:
      return "the peer speaks plain: it has no certificate, or is no coordinator; give it one, or leave this "
             "side's "
             "certificate out";
    case SSL_R_UNSUPPORTED_PROTOCOL:
    case SSL_R_UNKNOWN_PROTOCOL:
      return "the peer does not speak TLS 1.3: install the same release on both machines";
    case SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE:
      return "the peer shows no certificate: give it the folder that `kiln cert issue` made";
    default:
      return text("TLS failed: {}", code.message());
  }
}

}  // namespace

std::string wire_words(const asio::error_code& code, const PeerCheck* check) {
  if (check && !check->failure.empty()) return check->failure;
  if (code == asio::error::eof) return "the peer closed the connection";
  if (code == asio::ssl::error::stream_truncated)
    return "the connection was cut: the peer closed it without a message";
  if (code.category() == asio::error::get_ssl_category()) return tls_words(code);
  return code.message();
}

}  // namespace kiln

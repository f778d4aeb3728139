#include "common/wire/tls.h"

#include <ctime>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/tls_impl.h"

namespace kiln {
namespace {

Certificate certificate_of(X509* x) {
  auto read = x ? read_certificate_of(x) : fail(ErrorKind::kInvalidInput, "");
  return read ? std::move(*read) : Certificate{};
}

// The message for a chain that OpenSSL rejects because of the certificate `c`.
std::string chain_words(int error, const Certificate& c, const std::string& host) {
  const std::string who = text("the peer's certificate ({}, serial {})", c.identity.name, c.identity.serial);
  switch (error) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return text("{} expired on {}: make a new one with `kiln cert issue`", who,
                  date_text(c.identity.not_after));
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return text("{} is valid from {} only: are both machines' clocks right ({} here)?", who,
                  date_text(c.not_before), date_text(std::time(nullptr)));
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH: {
      std::string names;
      for (const std::string& name : c.hosts) names += (names.empty() ? "" : ", ") + name;
      return text(
          "{} does not speak for {}, but for {}: connect to one of these, or issue it again with --host {}",
          who, host, names.empty() ? "no host" : names, host);
    }
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
      return text(
          "{} is signed by \"{}\", which is not the authority in this side's ca.pem: both sides need "
          "certificates of one authority",
          who, c.issuer);
    case X509_V_ERR_INVALID_PURPOSE:
      return text("{} has the roles {} and may not be a coordinator's: connect to the coordinator itself",
                  who, role_list(c.identity.roles));
    default:
      return text("{} is refused: {}", who, X509_verify_cert_error_string(error));
  }
}

// This side's check of the leaf certificate of a valid chain: an OpenSSL error code, and a message.
struct Verdict {
  int error = X509_V_OK;
  std::string words;
};

Verdict judge(const Certificate& c, const TlsContext& context, bool peer_is_coordinator) {
  const auto revoked = context.is_revoked(c.identity.serial);
  if (!revoked) return {X509_V_ERR_APPLICATION_VERIFICATION, revoked.error().message};
  if (*revoked)
    return {X509_V_ERR_CERT_REVOKED,
            text("the peer's certificate ({}, serial {}) was revoked", c.identity.name, c.identity.serial)};
  if (peer_is_coordinator && !c.identity.has(Role::kCoordinator))
    return {X509_V_ERR_APPLICATION_VERIFICATION, text("the peer's certificate ({}) has the roles {}, not "
                                                      "coordinator: connect to the coordinator itself",
                                                      c.identity.name, role_list(c.identity.roles))};
  if (c.identity.roles.empty())
    return {X509_V_ERR_APPLICATION_VERIFICATION,
            text("the peer's certificate ({}) has no role of a farm: make one with `kiln cert issue --role`",
                 c.identity.name)};
  return {};
}

void verify(TlsStream& stream, const TlsContext& context, bool peer_is_coordinator, const std::string& host,
            PeerCheck& check) {
  stream.set_verify_callback([&context, peer_is_coordinator, host, &check](bool good,
                                                                           asio::ssl::verify_context& chain) {
    X509_STORE_CTX* store = chain.native_handle();
    if (good && X509_STORE_CTX_get_error_depth(store) > 0) return true;
    const Certificate c = certificate_of(X509_STORE_CTX_get_current_cert(store));
    const int error = X509_STORE_CTX_get_error(store);
    // An enrolment trusts one authority by its digest: OpenSSL goes on to check the signatures below it.
    if (!good && error == X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN && context.impl().pinned == c.fingerprint) {
      X509_STORE_CTX_set_error(store, X509_V_OK);
      return true;
    }
    if (!good) {
      // Errors at the chain's root are reported for the peer, whose certificate is at the other end.
      const bool trust = error != X509_V_ERR_CERT_HAS_EXPIRED && error != X509_V_ERR_CERT_NOT_YET_VALID;
      const Certificate leaf = trust ? certificate_of(X509_STORE_CTX_get0_cert(store)) : c;
      if (check.failure.empty()) check.failure = chain_words(error, leaf, host);
      return false;
    }
    Verdict verdict = judge(c, context, peer_is_coordinator);
    if (verdict.error == X509_V_OK) return true;
    check.failure = std::move(verdict.words);
    X509_STORE_CTX_set_error(store, verdict.error);
    return false;
  });
}

Expected<std::unique_ptr<TlsContext::Impl>> fresh_context(const std::vector<std::filesystem::path>& revoked) {
  auto impl = std::make_unique<TlsContext::Impl>(revoked);
  SSL_CTX* native = impl->context.native_handle();
  // No tickets: a resumed session would skip the revocation check.
  SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(native, SSL_OP_NO_TICKET | SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  if (SSL_CTX_set_min_proto_version(native, TLS1_3_VERSION) != 1 ||
      SSL_CTX_set_max_proto_version(native, TLS1_3_VERSION) != 1 || SSL_CTX_set_num_tickets(native, 0) != 1)
    return fail(ErrorKind::kInternal, "this OpenSSL has no TLS 1.3");
  return impl;
}

}  // namespace

void verify_coordinator(TlsStream& stream, const TlsContext& context, const std::string& host,
                        PeerCheck& check) {
  SSL* ssl = stream.native_handle();
  X509_VERIFY_PARAM* expected = SSL_get0_param(ssl);
  asio::error_code not_an_address;
  asio::ip::make_address(host, not_an_address);
  if (not_an_address) {
    SSL_set_tlsext_host_name(ssl, host.c_str());
    X509_VERIFY_PARAM_set_hostflags(expected,
                                    X509_CHECK_FLAG_NO_WILDCARDS | X509_CHECK_FLAG_NEVER_CHECK_SUBJECT);
    X509_VERIFY_PARAM_set1_host(expected, host.data(), host.size());
  } else {
    X509_VERIFY_PARAM_set1_ip_asc(expected, host.c_str());
  }
  stream.set_verify_mode(asio::ssl::verify_peer);
  verify(stream, context, true, host, check);
}

void verify_caller(TlsStream& stream, const TlsContext& context, bool admit_strangers, PeerCheck& check) {
  stream.set_verify_mode(admit_strangers ? asio::ssl::verify_peer
                                         : asio::ssl::verify_peer | asio::ssl::verify_fail_if_no_peer_cert);
  verify(stream, context, false, "", check);
}

PeerIdentity peer_identity(TlsStream& stream) {
  return certificate_of(SSL_get0_peer_certificate(stream.native_handle())).identity;
}

TlsContext::TlsContext(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TlsContext::~TlsContext() = default;

Expected<std::shared_ptr<const TlsContext>> TlsContext::load(const TlsFiles& files,
                                                             std::optional<int64_t> now) {
  KILN_TRY(TlsIdentity identity, load_identity(files, now.value_or(std::time(nullptr))));
  for (const std::string& warning : identity.warnings) log_warning(warning);
  std::vector<std::filesystem::path> lists = files.revoked;
  lists.push_back(files.ca.parent_path() / "revoked");
  KILN_TRY(auto impl, fresh_context(lists));
  asio::error_code code;
  impl->context.add_certificate_authority(asio::buffer(identity.ca), code);
  if (!code) impl->context.use_certificate(asio::buffer(identity.certificate), asio::ssl::context::pem, code);
  if (!code) impl->context.use_private_key(asio::buffer(identity.key), asio::ssl::context::pem, code);
  if (code)
    return fail(ErrorKind::kInvalidInput,
                text("TLS refuses the certificate {}: {}", files.certificate.string(), code.message()));
  impl->own = std::move(identity.own);
  std::shared_ptr<const TlsContext> context(new TlsContext(std::move(impl)));
  KILN_TRY_STATUS(
      context->is_revoked(context->own().identity.serial));  // report an unreadable list now, not later
  return context;
}

Expected<std::shared_ptr<const TlsContext>> TlsContext::for_enrolment(const Digest& authority) {
  KILN_TRY(auto impl, fresh_context({}));
  impl->pinned = authority;
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(impl)));
}

const Certificate& TlsContext::own() const {
  return impl_->own;
}

Expected<bool> TlsContext::is_revoked(const std::string& serial) const {
  return impl_->revoked.contains(serial);
}

RevocationLists::Extent TlsContext::revocations() const {
  return impl_->revoked.extent();
}

}  // namespace kiln

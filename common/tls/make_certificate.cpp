#include <arpa/inet.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/tls/certificate.h"
#include "common/tls/openssl_api.h"

namespace kiln {
namespace {
using namespace openssl;

constexpr size_t kMaxRequestBytes = 16 << 10;
constexpr int kMinSecurityBits = 112;  // NIST SP 800-57: RSA of 2048 bits, EC of 224

tl::unexpected<Error> library_error(const char* doing) {
  char reason[256];
  ERR_error_string_n(ERR_get_error(), reason, sizeof reason);
  ERR_clear_error();
  return fail(ErrorKind::kInternal, text("cannot {}: {}", doing, reason));
}

template <class T, class Write>
std::string to_pem(const T& object, const Write& write) {
  const BioPtr bio(BIO_new(BIO_s_mem()));
  KILN_CHECK(bio && write(bio.get(), object) == 1);
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return {data, static_cast<size_t>(size)};
}

std::string key_pem(EVP_PKEY* key) {
  return to_pem(key, [](BIO* bio, EVP_PKEY* k) {
    return PEM_write_bio_PrivateKey(bio, k, nullptr, nullptr, 0, nullptr, nullptr);
  });
}

Expected<KeyPtr> new_key() {
  KeyPtr key(EVP_EC_gen("P-256"));
  if (!key) return library_error("make a key");
  return key;
}

Status check_name(const std::string& name) {
  if (is_certificate_name(name)) return {};
  return fail(ErrorKind::kUsage,
              text("a certificate's name has 1 to 64 letters, digits, dots, dashes and "
                   "underscores, and begins with none of - and .; this one has not ({} bytes)",
                   name.size()));
}

void set_name(X509_NAME* name, const std::string& common) {
  KILN_CHECK(X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                                        reinterpret_cast<const unsigned char*>(common.data()),
                                        static_cast<int>(common.size()), -1, 0) == 1);
}

Expected<RequestPtr> read_request(std::string_view pem) {
  if (pem.size() > kMaxRequestBytes)
    return fail(ErrorKind::kInvalidInput, "the request is too large for a request of a certificate");
  const BioPtr bio = reader(pem);
  RequestPtr request(PEM_read_bio_X509_REQ(bio.get(), nullptr, no_pass_phrase, nullptr));
  EVP_PKEY* key = request ? X509_REQ_get0_pubkey(request.get()) : nullptr;
  const bool signed_by_itself = key && X509_REQ_verify(request.get(), key) == 1;
  ERR_clear_error();
  if (!request) return fail(ErrorKind::kInvalidInput, "the request is not one in PEM form");
  if (!signed_by_itself)
    return fail(ErrorKind::kInvalidInput, "the request is not signed with the key that it holds");
  if (EVP_PKEY_get_security_bits(key) < kMinSecurityBits)
    return fail(ErrorKind::kInvalidInput,
                "the request's key is too weak: EC P-256 is what kiln makes, RSA of 2048 bits the least");
  return request;
}

// "DNS:farm,IP:10.0.0.1": `host` has none of the characters that are special in this form.
Expected<std::string> host_entry(const std::string& host) {
  unsigned char address[16];
  if (::inet_pton(AF_INET, host.c_str(), address) == 1 || ::inet_pton(AF_INET6, host.c_str(), address) == 1)
    return "IP:" + host;
  const auto good = [](char c) {
    return c == '.' || c == '-' || std::isalnum(static_cast<unsigned char>(c));
  };
  if (host.empty() || host.size() > 253 || !std::all_of(host.begin(), host.end(), good))
    return fail(ErrorKind::kUsage,
                text("a host is a DNS name or an address, as in farm.studio.lan or 10.0.0.7; "
                     "this one is neither ({} bytes)",
                     host.size()));
  return "DNS:" + host;
}

// Unpredictable, positive, and long enough never to collide.
bool set_random_serial(X509* x) {
  const NumberPtr number(BN_new());
  return number && BN_rand(number.get(), 127, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(x));
}

bool add_extension(X509* x, X509* issuer, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, x, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str());
  const bool added = extension && X509_add_ext(x, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return added;
}

bool set_common_fields(X509* x, EVP_PKEY* key, const std::string& name, int64_t not_before,
                       int64_t not_after) {
  set_name(X509_get_subject_name(x), name);
  return X509_set_version(x, X509_VERSION_3) == 1 && set_random_serial(x) &&
         ASN1_TIME_set(X509_getm_notBefore(x), not_before) &&
         ASN1_TIME_set(X509_getm_notAfter(x), not_after) && X509_set_pubkey(x, key) == 1;
}

Expected<std::string> alternative_names(const CertificateTerms& terms) {
  std::string names;
  for (const Role role : terms.roles)
    names += text("{}URI:kiln:role:{}", names.empty() ? "" : ",", role_name(role));
  for (const std::string& host : terms.hosts) {
    KILN_TRY(const std::string entry, host_entry(host));
    names += "," + entry;
  }
  return names;
}

}  // namespace

Expected<KeyAndRequest> make_key_and_request(const std::string& name) {
  KILN_TRY_STATUS(check_name(name));
  KILN_TRY(const KeyPtr key, new_key());
  const RequestPtr request(X509_REQ_new());
  if (!request) return library_error("make a request");
  set_name(X509_REQ_get_subject_name(request.get()), name);
  if (X509_REQ_set_pubkey(request.get(), key.get()) != 1 ||
      X509_REQ_sign(request.get(), key.get(), EVP_sha256()) == 0)
    return library_error("sign a request");
  return KeyAndRequest{key_pem(key.get()), to_pem(request.get(), [](BIO* bio, X509_REQ* r) {
                         return PEM_write_bio_X509_REQ(bio, r);
                       })};
}

Expected<std::string> request_name(std::string_view pem) {
  KILN_TRY(const RequestPtr request, read_request(pem));
  char name[66] = "";
  const int size =
      X509_NAME_get_text_by_NID(X509_REQ_get_subject_name(request.get()), NID_commonName, name, sizeof name);
  if (size <= 0 || !is_certificate_name({name, static_cast<size_t>(size)}))
    return fail(ErrorKind::kInvalidInput,
                "the request states no name of letters, digits, dots, dashes and underscores");
  return std::string(name, static_cast<size_t>(size));
}

Expected<KeyAndCertificate> make_authority(const std::string& name, int64_t not_before, int64_t not_after) {
  KILN_TRY_STATUS(check_name(name));
  KILN_TRY(const KeyPtr key, new_key());
  const X509Ptr x(X509_new());
  if (!x || !set_common_fields(x.get(), key.get(), name, not_before, not_after))
    return library_error("make an authority");
  set_name(X509_get_issuer_name(x.get()), name);
  if (!add_extension(x.get(), x.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0") ||
      !add_extension(x.get(), x.get(), NID_key_usage, "critical,keyCertSign,cRLSign") ||
      !add_extension(x.get(), x.get(), NID_subject_key_identifier, "hash") ||
      X509_sign(x.get(), key.get(), EVP_sha256()) == 0)
    return library_error("sign an authority");
  return KeyAndCertificate{key_pem(key.get()),
                           to_pem(x.get(), [](BIO* bio, X509* c) { return PEM_write_bio_X509(bio, c); })};
}

Expected<std::string> sign_request(std::string_view request_pem, const KeyAndCertificate& authority,
                                   const CertificateTerms& terms) {
  KILN_TRY_STATUS(check_name(terms.name));
  if (terms.roles.empty()) return fail(ErrorKind::kUsage, "a certificate needs at least one role");
  KILN_TRY(const RequestPtr request, read_request(request_pem));
  KILN_TRY(const std::string names, alternative_names(terms));
  const X509Ptr issuer = read_x509(authority.certificate);
  const KeyPtr issuer_key = read_key(authority.key);
  if (!issuer || !issuer_key || X509_check_private_key(issuer.get(), issuer_key.get()) != 1) {
    ERR_clear_error();
    return fail(ErrorKind::kInvalidInput, "the authority's certificate and key do not belong together");
  }
  const X509Ptr x(X509_new());
  if (!x ||
      !set_common_fields(x.get(), X509_REQ_get0_pubkey(request.get()), terms.name, terms.not_before,
                         terms.not_after) ||
      X509_set_issuer_name(x.get(), X509_get_subject_name(issuer.get())) != 1)
    return library_error("make a certificate");
  // Only a coordinator may act as a TLS server.
  const bool server = std::count(terms.roles.begin(), terms.roles.end(), Role::kCoordinator) != 0;
  if (!add_extension(x.get(), issuer.get(), NID_basic_constraints, "critical,CA:FALSE") ||
      !add_extension(x.get(), issuer.get(), NID_key_usage, "critical,digitalSignature") ||
      !add_extension(x.get(), issuer.get(), NID_ext_key_usage,
                     server ? "serverAuth,clientAuth" : "clientAuth") ||
      !add_extension(x.get(), issuer.get(), NID_subject_alt_name, names) ||
      !add_extension(x.get(), issuer.get(), NID_subject_key_identifier, "hash") ||
      !add_extension(x.get(), issuer.get(), NID_authority_key_identifier, "keyid") ||
      X509_sign(x.get(), issuer_key.get(), EVP_sha256()) == 0)
    return library_error("sign a certificate");
  return to_pem(x.get(), [](BIO* bio, X509* c) { return PEM_write_bio_X509(bio, c); });
}

}  // namespace kiln

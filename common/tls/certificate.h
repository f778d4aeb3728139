// The farm's certificates: a peer's name and what it may do. A role is a URI among the certificate's subject
// alternative names (RFC 5280, section 4.2.1.6): kiln:role:worker.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/base/status.h"

struct x509_st;  // OpenSSL's X509

namespace kiln {

// Roles of people (read, submit, admin) do not imply each other: a certificate lists every role it grants.
enum class Role : uint8_t { kCoordinator, kWorker, kRead, kSubmit, kAdmin };
constexpr Role kAllRoles[] = {Role::kCoordinator, Role::kWorker, Role::kRead, Role::kSubmit, Role::kAdmin};
const char* role_name(Role role);  // "coordinator", "worker", ...
Expected<Role> parse_role(std::string_view name);
std::string role_list(const std::vector<Role>& roles);  // "read, submit"; "none"

struct PeerIdentity {
  std::string name;         // common name: a machine's or a person's
  std::vector<Role> roles;  // unknown ones are left out
  std::string serial;       // lower-case hex; empty: no certificate
  int64_t not_after = 0;    // seconds since 1970
  bool has(Role role) const;
};

struct Certificate {
  PeerIdentity identity;
  std::vector<std::string> hosts;  // DNS names and addresses it is valid for
  std::string issuer;              // common name
  int64_t not_before = 0;          // seconds since 1970
  bool authority = false;          // may sign others
  Digest fingerprint;              // SHA-256 of its DER form
};

// The first certificate of a PEM text. Fails (kInvalidInput) with a sentence that continues "FILE ...". Texts
// from a certificate are cut to 256 bytes, and what is not printable ASCII becomes "?".
Expected<Certificate> read_certificate(std::string_view pem);
Expected<Certificate> read_certificate_der(std::span<const std::byte> der);
Expected<Certificate> read_certificate_of(x509_st* certificate);

// "2027-03-01 12:00 UTC".
std::string date_text(int64_t seconds);

// Creating keys and certificates. Keys are EC P-256; everything is PEM.
struct KeyAndRequest {
  std::string key, request;
};
struct KeyAndCertificate {
  std::string key, certificate;
};
struct CertificateTerms {
  std::string name;
  std::vector<Role> roles;
  std::vector<std::string> hosts{};       // DNS names or addresses; a coordinator needs one
  int64_t not_before = 0, not_after = 0;  // seconds since 1970
};

// A machine's new key, which never leaves the machine, and the signing request for its public half.
Expected<KeyAndRequest> make_key_and_request(const std::string& name);
// The name that a request states. Fails unless the request is signed with the key it holds.
Expected<std::string> request_name(std::string_view request);
// A new self-signed authority, which may sign leaf certificates only.
Expected<KeyAndCertificate> make_authority(const std::string& name, int64_t not_before, int64_t not_after);
// Signs the public key of the request; name, roles and hosts are those of `terms`, whatever the request says.
// Fails (kUsage) on names and hosts with other characters than these may have.
Expected<std::string> sign_request(std::string_view request, const KeyAndCertificate& authority,
                                   const CertificateTerms& terms);

// 1 to 64 letters, digits, dots, dashes and underscores: usable as a file name and safe in a log line.
bool is_certificate_name(std::string_view name);

}  // namespace kiln

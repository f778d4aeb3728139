// Join tokens, with which a new machine gets its certificate. Only their digests are stored.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/hash.h"
#include "common/tls/certificate.h"

namespace kiln {

// "kiln-ID-SECRET-AUTHORITY", all hex: 8, 32 and 64 digits. The last part, the SHA-256 of the authority's
// certificate, lets the joining machine verify that it talks to the right coordinator
// (TlsContext::for_enrolment).
struct JoinToken {
  std::string id, secret;
  Digest authority;
  std::string text() const;
};
// Fails (kUsage) on anything else, without repeating it.
Expected<JoinToken> parse_join_token(std::string_view text);

struct TokenRecord {
  std::string id;
  Digest secret;  // SHA-256 of the secret's digits
  Role role = Role::kWorker;
  uint32_t uses = 0;    // remaining
  int64_t expires = 0;  // seconds since 1970
  bool operator==(const TokenRecord&) const = default;
};
// The file `tokens`: a line each, fields separated by a space.
Expected<std::vector<TokenRecord>> parse_token_file(std::string_view file);
std::string print_token_file(const std::vector<TokenRecord>& records);

// Creates a token. Roles: worker, read or submit; coordinators' and admins' certificates are issued by hand.
Expected<JoinToken> make_token(const std::filesystem::path& dir, Role role, uint32_t uses, int64_t hours,
                               int64_t now);

struct Enrolment {
  std::string certificate, authority;  // PEM
};
// Uses the token once and signs the request (sign_request) for the name it states, for 365 days. The use is
// on disk before the certificate exists: a crash in between loses a use but never allows one twice. Errors
// (kUsage) do not reveal whether the token never existed, expired or is used up; the log does. A name that
// another good certificate has is refused (check_new_name).
Expected<Enrolment> redeem_token(const std::filesystem::path& dir, const std::string& token,
                                 const std::string& request, int64_t now);

}  // namespace kiln

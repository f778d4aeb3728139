// Join tokens: words by which a new machine gets its certificate. Only their digests are kept.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/hash.h"
#include "common/tls/certificate.h"

namespace kiln {

// "kiln-ID-SECRET-AUTHORITY", all hex: 8, 32 and 64 digits. The machine that joins knows by the last part,
// the SHA-256 of the authority's certificate, that it talks to the right coordinator
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
  uint32_t uses = 0;    // that are left
  int64_t expires = 0;  // seconds since 1970
  bool operator==(const TokenRecord&) const = default;
};
// The file `tokens`: a line each, fields separated by a space.
Expected<std::vector<TokenRecord>> parse_token_file(std::string_view file);
std::string print_token_file(const std::vector<TokenRecord>& records);

// Makes a token. Roles: worker, read or submit; a coordinator's or an admin's certificate is issued by hand.
Expected<JoinToken> make_token(const std::filesystem::path& dir, Role role, uint32_t uses, int64_t hours,
                               int64_t now);

struct Enrolment {
  std::string certificate, authority;  // PEM
};
// Takes one use of the token and signs the request (sign_request) for the name it states, for 365 days. The
// use is on disk before the certificate is made: a crash between loses a use, and never gives one twice.
// Errors (kUsage) do not say whether the token never was, has ended or is used up, but to the log.
Expected<Enrolment> redeem_token(const std::filesystem::path& dir, const std::string& token,
                                 const std::string& request, int64_t now);

}  // namespace kiln

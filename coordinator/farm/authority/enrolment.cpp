// Tokens in the authority's folder.
#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/authority/authority.h"
#include "coordinator/farm/authority/tokens.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kMaxFileBytes = 16 << 20;
constexpr int64_t kMaxHours = 24 * 365;
constexpr int64_t kSecondsAnHour = 3600;
constexpr int64_t kEnrolledDays = 365;

Expected<std::vector<TokenRecord>> read_tokens(const fs::path& dir) {
  std::error_code code;
  if (!fs::exists(dir / "tokens", code)) return std::vector<TokenRecord>();
  KILN_TRY(const Bytes bytes, read_file(dir / "tokens", kMaxFileBytes));
  auto records = parse_token_file({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!records)
    return fail(ErrorKind::kInvalidInput, text("{}: {}", (dir / "tokens").string(), records.error().message));
  return records;
}

Digest digest_of(const std::string& secret) {
  return sha256(bytes_of(secret));
}

Expected<Certificate> read_ca(const fs::path& dir, std::string& pem) {
  auto bytes = read_file(dir / "ca.pem", kMaxFileBytes);
  if (!bytes)
    return fail(ErrorKind::kUsage, text("{}; make an authority with `kiln cert ca --dir {}`",
                                        bytes.error().message, dir.string()));
  pem.assign(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  auto ca = read_certificate(pem);
  if (!ca)
    return fail(ErrorKind::kInvalidInput, text("{} {}", (dir / "ca.pem").string(), ca.error().message));
  return std::move(*ca);
}

// Decrements the token's uses, on disk; a name that is taken costs none.
Expected<Role> take_use(const fs::path& dir, const JoinToken& token, const std::string& name, int64_t now) {
  KILN_TRY(const AuthorityLock lock, AuthorityLock::take(dir));
  KILN_TRY(std::vector<TokenRecord> records, read_tokens(dir));
  const auto at =
      std::find_if(records.begin(), records.end(), [&](const auto& r) { return r.id == token.id; });
  const std::string secret = digest_of(token.secret).hex();
  const char* why = at == records.end()                       ? "it was never created here, or has expired"
                    : !equal_secret(at->secret.hex(), secret) ? "its secret is wrong"
                    : at->expires <= now                      ? "it has ended"
                    : at->uses == 0                           ? "it is used up"
                                                              : nullptr;
  if (why) {
    log_warning(text("join token {} is refused: {}", token.id, why));
    return fail(ErrorKind::kUsage,
                "this join token is not valid here, or no longer: ask for a new one (`kiln cert "
                "token`)");
  }
  KILN_TRY_STATUS(check_new_name(dir, name, now));  // told to holders of a good token only
  const Role role = at->role;
  --at->uses;
  KILN_TRY_STATUS(write_private_file(dir / "tokens", print_token_file(records)));
  return role;
}

}  // namespace

Expected<JoinToken> make_token(const fs::path& dir, Role role, uint32_t uses, int64_t hours, int64_t now) {
  if (role == Role::kCoordinator || role == Role::kAdmin)
    return fail(ErrorKind::kUsage,
                text("a join token cannot make a certificate of the role {}: `kiln cert issue` does",
                     role_name(role)));
  if (uses < 1 || uses > 10'000) return fail(ErrorKind::kUsage, "a join token has 1 to 10000 uses");
  if (hours < 1 || hours > kMaxHours)
    return fail(ErrorKind::kUsage, text("a join token is good for 1 to {} hours", kMaxHours));
  std::string pem;
  KILN_TRY(const Certificate ca, read_ca(dir, pem));
  KILN_TRY(const AuthorityLock lock, AuthorityLock::take(dir));
  KILN_TRY(std::vector<TokenRecord> records, read_tokens(dir));
  std::erase_if(records, [&](const TokenRecord& r) { return r.expires <= now || r.uses == 0; });
  const JoinToken token{random_hex(4), random_hex(16), ca.fingerprint};
  records.push_back({token.id, digest_of(token.secret), role, uses, now + hours * kSecondsAnHour});
  KILN_TRY_STATUS(write_private_file(dir / "tokens", print_token_file(records)));
  return token;
}

Expected<Enrolment> redeem_token(const fs::path& dir, const std::string& typed, const std::string& request,
                                 int64_t now) {
  KILN_TRY(const JoinToken token, parse_join_token(typed));
  KILN_TRY(const std::string name, request_name(request));  // before a use is spent
  Enrolment enrolment;
  KILN_TRY_STATUS(read_ca(dir, enrolment.authority).map([](const auto&) {}));
  KILN_TRY(const Role role, take_use(dir, token, name, now));
  KILN_TRY(enrolment.certificate, sign(dir, request, {name, {role}, {}, kEnrolledDays, true}, now));
  return enrolment;
}

}  // namespace kiln

#include "coordinator/service/people.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMaxUser = 64;
constexpr uint64_t kMaxTokenBytes = 4096;

// The first line of the file; if there is no file, one with a new token is made.
Expected<std::string> token_in(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) {
    const std::string token = random_hex(16);
    KILN_TRY_STATUS(write_private_file(file, token + "\n"));
    return token;
  }
  KILN_TRY(const Bytes bytes, read_file(file, kMaxTokenBytes));
  std::string token(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  token.resize(std::min(token.find_first_of("\r\n"), token.size()));
  if (token.size() < 16)
    return fail(
        ErrorKind::kUsage,
        text("{} holds no token of at least 16 characters: remove it and a new one is made", file.string()));
  return token;
}

bool is_user(const std::string& name) {
  return !name.empty() && name.size() <= kMaxUser &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 32 || c == 127; });
}

}  // namespace

const char* access_name(Access access) {
  static constexpr const char* kNames[] = {"enrol", "read", "submit", "admin"};
  return kNames[static_cast<size_t>(access)];
}

Expected<ServiceTokens> service_tokens(const std::filesystem::path& data) {
  ServiceTokens tokens;
  KILN_TRY(tokens.admin, token_in(data / "admin.token"));
  KILN_TRY(tokens.submit, token_in(data / "submit.token"));
  KILN_TRY(tokens.read, token_in(data / "read.token"));
  KILN_TRY(tokens.worker, token_in(data / "worker.token"));
  return tokens;
}

Expected<Caller> recognise(const ClientHello& hello, const PeerIdentity& identity, bool tls,
                           const ServiceTokens& tokens) {
  if (tls) {
    if (identity.serial.empty()) return Caller{"", Access::kEnrol};
    const Caller caller{identity.name, identity.has(Role::kAdmin)    ? Access::kAdmin
                                       : identity.has(Role::kSubmit) ? Access::kSubmit
                                       : identity.has(Role::kRead)   ? Access::kRead
                                                                     : Access::kEnrol};
    if (caller.access == Access::kEnrol)
      return fail(
          ErrorKind::kUsage,
          text("the certificate of {} has the roles {}: people need read, submit or admin (`kiln cert issue "
               "--role submit`)",
               identity.name, role_list(identity.roles)));
    return caller;
  }
  if (!is_user(hello.user))
    return fail(ErrorKind::kUsage, text("a user's name has 1 to {} printable characters", kMaxUser));
  const std::pair<const std::string&, Access> known[] = {
      {tokens.admin, Access::kAdmin}, {tokens.submit, Access::kSubmit}, {tokens.read, Access::kRead}};
  for (const auto& [token, access] : known)
    if (equal_secret(hello.token, token)) return Caller{hello.user, access};
  return fail(
      ErrorKind::kUsage,
      hello.token.empty() ? "no token was given: use --token-file or KILN_TOKEN_FILE with the coordinator's "
                            "submit.token, read.token or admin.token"
      : equal_secret(hello.token, tokens.worker)
          ? "this is the token of workers: people need the coordinator's submit.token, read.token or "
            "admin.token"
          : "the token is not one of this coordinator's: submit.token, read.token and admin.token lie in its "
            "data folder");
}

}  // namespace kiln

#include "coordinator/service/people.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMaxUser = 64;
constexpr uint64_t kMaxTokenBytes = 64 << 10;
constexpr size_t kMinTokenBytes = 16;

Expected<std::string> read_text(const std::filesystem::path& file) {
  KILN_TRY(const Bytes bytes, read_file(file, kMaxTokenBytes));
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Removes and returns the first line.
std::string next_line(std::string& text) {
  const size_t end = std::min(text.find_first_of("\r\n"), text.size());
  std::string line = text.substr(0, end);
  text.erase(0, std::min(text.find('\n', end), text.size() - 1) + 1);
  return line;
}

Status make_token_file(const std::filesystem::path& file) {
  std::error_code code;
  if (std::filesystem::exists(file, code)) return {};
  return write_private_file(file, random_hex(16) + "\n");
}

// The first line of the file; if there is no file, one with a new token is made.
Expected<std::string> token_in(const std::filesystem::path& file) {
  KILN_TRY_STATUS(make_token_file(file));
  KILN_TRY(std::string text, read_text(file));
  std::string token = next_line(text);
  if (token.size() < kMinTokenBytes)
    return fail(ErrorKind::kUsage,
                kiln::text("{} holds no token of at least {} characters: remove it and a new one is made",
                           file.string(), kMinTokenBytes));
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
  KILN_TRY(tokens.web, token_in(data / "web.token"));
  KILN_TRY_STATUS(make_token_file(data / "worker.token"));
  KILN_TRY(tokens.worker, read_worker_tokens(data / "worker.token"));
  return tokens;
}

Expected<WorkerTokens> read_worker_tokens(const std::filesystem::path& file) {
  WorkerTokens tokens;
  KILN_TRY(tokens.shared, token_in(file));
  KILN_TRY(std::string text, read_text(file));
  next_line(text);
  for (size_t number = 2; !text.empty(); ++number) {
    const std::string line = next_line(text);
    if (line.empty() || line[0] == '#') continue;
    const size_t space = std::min(line.find(' '), line.size());
    const std::string name = line.substr(0, space), token = line.substr(std::min(space + 1, line.size()));
    if (!is_certificate_name(name) || token.size() < kMinTokenBytes || token.find(' ') != token.npos)
      return fail(
          ErrorKind::kUsage,
          kiln::text("{}, line {}: after the token of all workers a line is NAME TOKEN, a name of letters, "
                     "digits, dots, dashes and underscores and a token of at least {} characters",
                     file.string(), number, kMinTokenBytes));
    if (!tokens.owners.emplace(name, token).second)
      return fail(ErrorKind::kUsage,
                  kiln::text("{}, line {}: {} has a token already", file.string(), number, name));
  }
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
      : equal_secret(hello.token, tokens.worker.shared)
          ? "this is the token of workers: people need the coordinator's submit.token, read.token or "
            "admin.token"
          : "the token is not one of this coordinator's: submit.token, read.token and admin.token lie in its "
            "data folder");
}

}  // namespace kiln

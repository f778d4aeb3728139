#include <pwd.h>
#include <unistd.h>

#include <cstdlib>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/farm/client/service_client.h"

namespace kiln {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string either(const std::string& given, const char* name) {
  return given.empty() ? variable(name) : given;
}

Expected<std::string> read_token(const std::string& file) {
  KILN_TRY(const Bytes bytes, read_file(file, 4096));
  std::string token(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  token.resize(std::min(token.find_first_of("\r\n"), token.size()));
  if (token.empty()) return fail(ErrorKind::kUsage, text("{} is empty: it should hold a token", file));
  return token;
}

std::string user_name() {
  if (const passwd* entry = ::getpwuid(::getuid())) return entry->pw_name;
  return text("user-{}", ::getuid());
}

}  // namespace

Expected<ClientOptions> client_options(const GivenOptions& given) {
  ClientOptions options;
  if (const std::string server = either(given.server, "KILN_SERVER"); !server.empty())
    options.server = server;
  options.ca = either(given.ca, "KILN_CA");
  options.certificate = either(given.certificate, "KILN_CERTIFICATE");
  options.key = either(given.key, "KILN_KEY");
  const int files = !options.ca.empty() + !options.certificate.empty() + !options.key.empty();
  if (files != 0 && files != 3)
    return fail(ErrorKind::kUsage,
                "--ca, --certificate and --key (KILN_CA, KILN_CERTIFICATE, KILN_KEY) belong "
                "together: give all three or none");
  options.token = given.token_file.empty() ? variable("KILN_TOKEN") : "";
  if (const std::string file = either(given.token_file, "KILN_TOKEN_FILE");
      options.token.empty() && !file.empty()) {
    KILN_TRY(options.token, read_token(file));
  }
  options.user = user_name();
  return options;
}

}  // namespace kiln

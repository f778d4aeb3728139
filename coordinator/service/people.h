// Identifies a client and its permissions: by certificate, or by token without TLS.
#pragma once

#include <filesystem>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/messages.h"
#include "coordinator/service/service.h"

namespace kiln {

// Each includes the permissions of those before it.
enum class Access : uint8_t { kEnrol, kRead, kSubmit, kAdmin };
const char* access_name(Access access);

struct Caller {
  std::string user;
  Access access = Access::kEnrol;
  std::string peer{};  // "address:port"
};

// `tls`: the connection is encrypted. Then the token does not count, and a client without a
// certificate may only ask for one.
Expected<Caller> recognise(const ClientHello& hello, const PeerIdentity& identity, bool tls,
                           const ServiceTokens& tokens);

}  // namespace kiln

// Who a client is and what it may do: by its certificate, or without TLS by its token.
#pragma once

#include <filesystem>
#include <string>

#include "common/tls/certificate.h"
#include "common/wire/messages.h"
#include "coordinator/service/service.h"

namespace kiln {

// Each may what those before it may.
enum class Access : uint8_t { kEnrol, kRead, kSubmit, kAdmin };
const char* access_name(Access access);

struct Caller {
  std::string user;
  Access access = Access::kEnrol;
};

// `tls`: the connection is encrypted; then the token does not count, and who shows no certificate may ask for
// one.
Expected<Caller> recognise(const ClientHello& hello, const PeerIdentity& identity, bool tls,
                           const ServiceTokens& tokens);

}  // namespace kiln

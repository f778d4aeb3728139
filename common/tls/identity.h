// The files that a program shows and trusts in a TLS connection.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/tls/certificate.h"

namespace kiln {

struct TlsFiles {
  std::filesystem::path ca, certificate, key;
  std::filesystem::path revoked{};  // empty: the file "revoked" beside `ca`, if it is there
};
// The files of a folder that `kiln cert issue` made: ca.pem, cert.pem, key.pem.
TlsFiles tls_files_in(const std::filesystem::path& folder);

// The files' texts, which fit each other.
struct TlsIdentity {
  std::string ca, certificate, key;  // PEM
  Certificate own;
  std::vector<std::string> warnings;  // sentences: a key that others can read, a certificate that ends soon
};

// Reads and holds the files against each other at the time `now` (seconds since 1970): there, readable, a
// certificate, signed by this authority, valid today, with this key. Errors name the file and the way out.
Expected<TlsIdentity> load_identity(const TlsFiles& files, int64_t now);

}  // namespace kiln

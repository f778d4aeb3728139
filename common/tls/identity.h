// The files a program presents and trusts in a TLS connection.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/tls/certificate.h"

namespace kiln {

struct TlsFiles {
  std::filesystem::path ca, certificate, key;
  // Lists of revoked certificates besides the file "revoked" that may lie beside `ca`.
  std::vector<std::filesystem::path> revoked{};
};
// The files of a folder that `kiln cert issue` made: ca.pem, cert.pem, key.pem.
TlsFiles tls_files_in(const std::filesystem::path& folder);

// The files' contents, checked against each other.
struct TlsIdentity {
  std::string ca, certificate, key;  // PEM
  Certificate own;
  std::vector<std::string>
      warnings;  // sentences: a key that others can read, a certificate that expires soon
};

// Reads the files and checks at the time `now` (seconds since 1970) that each exists and parses, and that the
// certificate is signed by this authority, valid today, and has this key. Errors name the file and the way
// out.
Expected<TlsIdentity> load_identity(const TlsFiles& files, int64_t now);

}  // namespace kiln

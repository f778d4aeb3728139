// The certificates a program presents and trusts. TLS 1.3 only; both sides present one.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/tls/identity.h"
#include "common/tls/revocation.h"

namespace kiln {

// Immutable except for the lists of revoked certificates, which are read again when they change.
// Thread-safe.
class TlsContext {
 public:
  // Reads the files (errors: load_identity) and logs their warnings. A listener's certificate must be a
  // coordinator's; a connecting side's may have any role.
  // The files must be valid at `now` (seconds since 1970; by default the current time).
  static Expected<std::shared_ptr<const TlsContext>> load(const TlsFiles& files,
                                                          std::optional<int64_t> now = std::nullopt);
  // For a machine without a certificate yet: connects to a coordinator whose authority has this SHA-256,
  // taken from a join token, and presents none. The other side uses ListenOptions::admit_strangers.
  static Expected<std::shared_ptr<const TlsContext>> for_enrolment(const Digest& authority);
  ~TlsContext();

  const Certificate& own() const;  // empty for an enrolment
  // Whether the lists of revoked certificates name this serial now; fails as RevocationLists::contains does.
  Expected<bool> is_revoked(const std::string& serial) const;
  RevocationLists::Extent revocations() const;

  struct Impl;
  Impl& impl() const { return *impl_; }

 private:
  explicit TlsContext(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln

// What a program shows and trusts on its connections. TLS 1.3 only; both sides show a certificate.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/tls/identity.h"

namespace kiln {

// Immutable but for the list of revoked certificates, which is read again when it changes. From any thread.
class TlsContext {
 public:
  // Reads the files (errors: load_identity) and logs their warnings. A listener's certificate must be a
  // coordinator's; a connecting side's may have any role.
  // The files must be good at `now` (seconds since 1970; by default the present).
  static Expected<std::shared_ptr<const TlsContext>> load(const TlsFiles& files,
                                                          std::optional<int64_t> now = std::nullopt);
  // Before a machine has a certificate: connects to a coordinator whose authority has this SHA-256, which a
  // join token states, and shows nothing. For ListenOptions::admit_strangers on the other side.
  static Expected<std::shared_ptr<const TlsContext>> for_enrolment(const Digest& authority);
  ~TlsContext();

  const Certificate& own() const;  // empty for an enrolment
  // Whether the list names this serial by now; fails when the list cannot be read.
  Expected<bool> is_revoked(const std::string& serial) const;

  struct Impl;
  Impl& impl() const { return *impl_; }

 private:
  explicit TlsContext(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln

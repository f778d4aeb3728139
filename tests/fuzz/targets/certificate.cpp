// What a certificate, a request or a list of revoked serials holds: the first byte says which, or DER.
#include "common/tls/certificate.h"

#include <algorithm>

#include "common/tls/revocation.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {
namespace {

void check_certificate(const Expected<Certificate>& c) {
  require_sentence(c);
  if (!c) return;
  require(!c->identity.serial.empty(), "a certificate has a serial");
  for (const std::string& text : {c->identity.name, c->issuer})
    require(std::all_of(text.begin(), text.end(), [](char k) { return k >= ' ' && k <= '~'; }),
            "a certificate's text cannot break a line of a log");
}

}  // namespace

void fuzz_certificate(std::span<const std::byte> data) {
  if (data.empty()) return;
  const auto rest = data.subspan(1);
  switch (static_cast<char>(data[0])) {
    case 'c':
      return check_certificate(read_certificate(text_of(rest)));
    case 'r':
      return require_sentence(request_name(text_of(rest)));
    case 'v':
      return require_sentence(parse_revoked(text_of(rest)));
    default:
      return check_certificate(read_certificate_der(rest));
  }
}

}  // namespace kiln::fuzz

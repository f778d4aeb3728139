#include "common/tls/identity.h"

#include <sys/stat.h>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/tls/openssl_api.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kMaxFileBytes = 64 << 10;
constexpr int64_t kDay = 86400;
constexpr int64_t kSoon = 14 * kDay;

Expected<std::string> read_pem(const fs::path& path, const char* what) {
  if (path.empty())
    return fail(ErrorKind::kUsage, text("TLS needs the file of {}: `kiln cert issue` makes a folder with all "
                                        "three files",
                                        what));
  const auto bytes = read_file(path, kMaxFileBytes);
  if (!bytes)
    return fail(ErrorKind::kInvalidInput,
                text("{}: {}; `kiln cert issue` makes it", what, bytes.error().message));
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

Expected<Certificate> read_named(const fs::path& path, const std::string& pem) {
  auto certificate = read_certificate(pem);
  if (!certificate)
    return fail(ErrorKind::kInvalidInput, text("{} {}", path.string(), certificate.error().message));
  return std::move(*certificate);
}

Status check_dates(const fs::path& path, const Certificate& c, int64_t now, const char* way_out) {
  if (now > c.identity.not_after)
    return fail(ErrorKind::kInvalidInput, text("the certificate {} of {} expired on {}: {}", path.string(),
                                               c.identity.name, date_text(c.identity.not_after), way_out));
  if (now < c.not_before)
    return fail(ErrorKind::kInvalidInput,
                text("the certificate {} of {} is valid from {} only: is this machine's clock right ({})?",
                     path.string(), c.identity.name, date_text(c.not_before), date_text(now)));
  return {};
}

bool is_signed_by(const std::string& certificate, const std::string& ca) {
  const openssl::X509Ptr leaf = openssl::read_x509(certificate);
  const openssl::BioPtr bundle = openssl::reader(ca);
  bool found = false;
  while (leaf && !found) {
    const openssl::X509Ptr issuer(PEM_read_bio_X509(bundle.get(), nullptr, openssl::no_pass_phrase, nullptr));
    if (!issuer) break;
    found = X509_verify(leaf.get(), X509_get0_pubkey(issuer.get())) == 1;
  }
  ERR_clear_error();
  return found;
}

Status check_key(const TlsFiles& files, const TlsIdentity& identity) {
  const openssl::KeyPtr key = openssl::read_key(identity.key);
  if (!key)
    return fail(ErrorKind::kInvalidInput,
                text("{} holds no private key in PEM form without a pass phrase", files.key.string()));
  const openssl::X509Ptr x = openssl::read_x509(identity.certificate);
  const bool fits = x && X509_check_private_key(x.get(), key.get()) == 1;
  ERR_clear_error();
  if (!fits)
    return fail(ErrorKind::kInvalidInput,
                text("the key {} is not the one of the certificate {}: take both from "
                     "the same folder",
                     files.key.string(), files.certificate.string()));
  return {};
}

}  // namespace

TlsFiles tls_files_in(const fs::path& folder) {
  return {folder / "ca.pem", folder / "cert.pem", folder / "key.pem"};
}

Expected<TlsIdentity> load_identity(const TlsFiles& files, int64_t now) {
  TlsIdentity identity;
  KILN_TRY(identity.ca, read_pem(files.ca, "the authority's certificate"));
  KILN_TRY(identity.certificate, read_pem(files.certificate, "this machine's certificate"));
  KILN_TRY(identity.key, read_pem(files.key, "this machine's key"));
  KILN_TRY(const Certificate ca, read_named(files.ca, identity.ca));
  KILN_TRY(identity.own, read_named(files.certificate, identity.certificate));
  if (!ca.authority)
    return fail(ErrorKind::kInvalidInput,
                text("{} is the certificate of {}, not of an authority: take ca.pem of the "
                     "folder that `kiln cert ca` made",
                     files.ca.string(), ca.identity.name));
  KILN_TRY_STATUS(check_key(files, identity));
  if (!is_signed_by(identity.certificate, identity.ca))
    return fail(
        ErrorKind::kInvalidInput,
        text("the certificate {} of {} was not signed by the authority in {}: take both from the same folder",
             files.certificate.string(), identity.own.identity.name, files.ca.string()));
  KILN_TRY_STATUS(check_dates(files.ca, ca, now, "make a new authority with `kiln cert ca`"));
  KILN_TRY_STATUS(check_dates(files.certificate, identity.own, now, "make a new one with `kiln cert issue`"));
  if (identity.own.identity.not_after - now < kSoon)
    identity.warnings.push_back(text("the certificate {} ends on {}: make a new one with `kiln cert issue`",
                                     files.certificate.string(), date_text(identity.own.identity.not_after)));
  struct stat mode {};
  if (::stat(files.key.c_str(), &mode) == 0 && (mode.st_mode & 077) != 0)
    identity.warnings.push_back(text("others on this machine can read the key {}: chmod 600 {}",
                                     files.key.string(), files.key.string()));
  return identity;
}

}  // namespace kiln

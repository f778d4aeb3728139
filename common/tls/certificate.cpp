#include "common/tls/certificate.h"

#include <arpa/inet.h>

#include <algorithm>
#include <ctime>

#include "common/base/bytes.h"
#include "common/base/format.h"
#include "common/tls/openssl_api.h"

namespace kiln {
namespace {

constexpr std::string_view kRolePrefix = "kiln:role:";
constexpr size_t kMaxNameBytes = 256;
constexpr size_t kMaxCertificateBytes = 64 << 10;

std::string printable(std::string_view bytes) {
  std::string out(bytes.substr(0, kMaxNameBytes));
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  return out;
}

std::string common_name(const X509_NAME* name) {
  const int at = X509_NAME_get_index_by_NID(name, NID_commonName, -1);
  if (at < 0) return {};
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at)));
  if (size < 0) return {};
  std::string text = printable({reinterpret_cast<char*>(utf8), static_cast<size_t>(size)});
  OPENSSL_free(utf8);
  return text;
}

Expected<int64_t> seconds_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (!time || ASN1_TIME_to_tm(time, &parts) != 1)
    return fail(ErrorKind::kInvalidInput, "has a date that cannot be read");
  return static_cast<int64_t>(::timegm(&parts));
}

std::string serial_of(const X509* x) {
  const openssl::NumberPtr number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(x), nullptr));
  char* hex = number ? BN_bn2hex(number.get()) : nullptr;
  std::string text = hex ? printable(hex) : std::string();
  OPENSSL_free(hex);
  for (char& c : text)
    if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string address_text(std::string_view bytes) {
  char text[INET6_ADDRSTRLEN] = "";
  if (bytes.size() == 4 || bytes.size() == 16)
    ::inet_ntop(bytes.size() == 4 ? AF_INET : AF_INET6, bytes.data(), text, sizeof text);
  return text;
}

void read_alternative_names(const X509* x, Certificate& certificate) {
  auto* names = static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(x, NID_subject_alt_name, nullptr, nullptr));
  for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names, i);
    if (name->type != GEN_URI && name->type != GEN_DNS && name->type != GEN_IPADD) continue;
    const ASN1_STRING* data = name->type == GEN_IPADD ? name->d.iPAddress : name->d.ia5;
    const std::string_view bytes(reinterpret_cast<const char*>(ASN1_STRING_get0_data(data)),
                                 static_cast<size_t>(ASN1_STRING_length(data)));
    if (name->type == GEN_URI && bytes.substr(0, kRolePrefix.size()) == kRolePrefix) {
      const auto role = parse_role(bytes.substr(kRolePrefix.size()));
      if (role && !certificate.identity.has(*role)) certificate.identity.roles.push_back(*role);
    } else if (name->type != GEN_URI) {
      certificate.hosts.push_back(name->type == GEN_DNS ? printable(bytes) : address_text(bytes));
    }
  }
  GENERAL_NAMES_free(names);
}

}  // namespace

const char* role_name(Role role) {
  switch (role) {
    case Role::kCoordinator:
      return "coordinator";
    case Role::kWorker:
      return "worker";
    case Role::kRead:
      return "read";
    case Role::kSubmit:
      return "submit";
    case Role::kAdmin:
      return "admin";
  }
  return "?";
}

Expected<Role> parse_role(std::string_view name) {
  for (const Role role : kAllRoles)
    if (name == role_name(role)) return role;
  return fail(ErrorKind::kUsage, text("\"{}\" is not a role: one of {}", printable(name),
                                      role_list({std::begin(kAllRoles), std::end(kAllRoles)})));
}

std::string role_list(const std::vector<Role>& roles) {
  std::string list;
  for (const Role role : roles) list += (list.empty() ? "" : ", ") + std::string(role_name(role));
  return list.empty() ? "none" : list;
}

bool PeerIdentity::has(Role role) const {
  return std::find(roles.begin(), roles.end(), role) != roles.end();
}

Expected<Certificate> read_certificate(std::string_view pem) {
  if (pem.size() > kMaxCertificateBytes)
    return fail(ErrorKind::kInvalidInput, "is too large for a certificate");
  const openssl::X509Ptr x = openssl::read_x509(pem);
  if (!x) return fail(ErrorKind::kInvalidInput, "holds no certificate in PEM form");
  return read_certificate_of(x.get());
}

Expected<Certificate> read_certificate_der(std::span<const std::byte> der) {
  if (der.size() > kMaxCertificateBytes)
    return fail(ErrorKind::kInvalidInput, "is too large for a certificate");
  const auto* at = reinterpret_cast<const unsigned char*>(der.data());
  const openssl::X509Ptr x(d2i_X509(nullptr, &at, static_cast<long>(der.size())));
  ERR_clear_error();
  if (!x) return fail(ErrorKind::kInvalidInput, "is not a certificate");
  return read_certificate_of(x.get());
}

Expected<Certificate> read_certificate_of(X509* x) {
  Certificate c;
  c.identity.name = common_name(X509_get_subject_name(x));
  c.identity.serial = serial_of(x);
  if (c.identity.serial.empty()) return fail(ErrorKind::kInvalidInput, "has no serial number");
  KILN_TRY(c.identity.not_after, seconds_of(X509_get0_notAfter(x)));
  KILN_TRY(c.not_before, seconds_of(X509_get0_notBefore(x)));
  c.issuer = common_name(X509_get_issuer_name(x));
  c.authority = X509_check_ca(x) == 1;
  read_alternative_names(x, c);
  unsigned size = 0;
  if (X509_digest(x, EVP_sha256(), c.fingerprint.bytes.data(), &size) != 1 ||
      size != c.fingerprint.bytes.size())
    return fail(ErrorKind::kInvalidInput, "has no digest");
  ERR_clear_error();
  return c;
}

std::string date_text(int64_t seconds) {
  const std::time_t time = seconds;
  std::tm parts{};
  if (!::gmtime_r(&time, &parts)) return "an impossible date";
  return text("{:04}-{:02}-{:02} {:02}:{:02} UTC", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday,
              parts.tm_hour, parts.tm_min);
}

bool is_certificate_name(std::string_view name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= 64 && name.front() != '-' && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), good);
}

}  // namespace kiln

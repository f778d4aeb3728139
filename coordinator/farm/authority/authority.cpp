#include "coordinator/farm/authority/authority.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/tls/revocation.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kMaxListBytes = 16 << 20;
constexpr int64_t kMaxDays = 36500;
constexpr int64_t kSkew = 300;  // s: a certificate is valid on machines whose clock is slightly behind

Expected<std::string> read_text(const fs::path& path) {
  KILN_TRY(const Bytes bytes, read_file(path, kMaxListBytes));
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Empty if there is none.
Expected<std::string> read_list(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) return std::string();
  return read_text(path);
}

Expected<KeyAndCertificate> read_authority(const fs::path& dir) {
  std::error_code code;
  if (!fs::exists(dir / "ca.pem", code))
    return fail(ErrorKind::kUsage, text("{} has no ca.pem: make an authority with `kiln cert ca --dir {}`",
                                        dir.string(), dir.string()));
  KILN_TRY(std::string certificate, read_text(dir / "ca.pem"));
  KILN_TRY(std::string key, read_text(dir / "ca.key"));
  return KeyAndCertificate{std::move(key), std::move(certificate)};
}

Status make_private_folder(const fs::path& dir) {
  std::error_code code;
  const bool made = fs::create_directories(dir, code);
  if (code || !fs::is_directory(dir))
    return fail(ErrorKind::kIo,
                text("cannot make the folder {}: {}", dir.string(), code ? code.message() : "it is a file"));
  if (made) fs::permissions(dir, fs::perms::owner_all, code);
  return {};
}

Status check_days(int64_t days) {
  if (days >= 1 && days <= kMaxDays) return {};
  return fail(ErrorKind::kUsage, text("a certificate is valid for 1 to {} days, not {}", kMaxDays, days));
}

std::string issued_line(const Certificate& c) {
  std::string roles;
  for (const Role role : c.identity.roles) roles += (roles.empty() ? "" : ",") + std::string(role_name(role));
  return text("{} {} {} {}\n", c.identity.serial, c.identity.name, roles, c.identity.not_after);
}

// With the lock held. The line is on disk before the certificate is returned, so that it can always be
// revoked by name.
Expected<std::string> sign_and_note(const fs::path& dir, const std::string& request, const IssueWish& wish,
                                    int64_t now) {
  KILN_TRY_STATUS(check_days(wish.days));
  if (wish.new_name) KILN_TRY_STATUS(check_new_name(dir, wish.name, now));
  KILN_TRY(const KeyAndCertificate authority, read_authority(dir));
  auto ca = read_certificate(authority.certificate);
  if (!ca)
    return fail(ErrorKind::kInvalidInput, text("{} {}", (dir / "ca.pem").string(), ca.error().message));
  if (ca->identity.not_after <= now)
    return fail(ErrorKind::kInvalidInput,
                text("the authority in {} ended on {}: make a new one in another folder", dir.string(),
                     date_text(ca->identity.not_after)));
  CertificateTerms terms{wish.name, wish.roles, wish.hosts, std::max(now - kSkew, ca->not_before),
                         std::min(now + wish.days * kSecondsADay, ca->identity.not_after)};
  KILN_TRY(std::string certificate, sign_request(request, authority, terms));
  KILN_TRY(const Certificate made, read_certificate(certificate));
  KILN_TRY(const std::string issued, read_list(dir / "issued"));
  KILN_TRY_STATUS(write_private_file(dir / "issued", issued + issued_line(made)));
  return certificate;
}

Expected<IssuedRecord> parse_issued(std::string_view line) {
  IssuedRecord record;
  std::string_view fields[4];
  for (auto& field : fields) {
    const size_t end = std::min(line.find(' '), line.size());
    field = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  record.serial = fields[0];
  record.name = fields[1];
  for (std::string_view roles = fields[2]; !roles.empty();) {
    const size_t end = std::min(roles.find(','), roles.size());
    KILN_TRY(const Role role, parse_role(roles.substr(0, end)));
    record.roles.push_back(role);
    roles.remove_prefix(std::min(end + 1, roles.size()));
  }
  const auto [stop, code] =
      std::from_chars(fields[3].data(), fields[3].data() + fields[3].size(), record.not_after);
  if (code != std::errc() || stop != fields[3].data() + fields[3].size() || !line.empty())
    return fail(ErrorKind::kInvalidInput, "it has not the four fields of a certificate");
  return record;
}

}  // namespace

Expected<AuthorityLock> AuthorityLock::take(const fs::path& dir) {
  const fs::path path = dir / "lock";
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  int got = fd < 0 ? -1 : ::flock(fd, LOCK_EX);
  while (got != 0 && fd >= 0 && errno == EINTR) got = ::flock(fd, LOCK_EX);
  if (got == 0) return AuthorityLock(fd);
  const int code = errno;
  if (fd >= 0) ::close(fd);
  return fail(ErrorKind::kIo,
              text("cannot lock the authority's folder {}: {}", dir.string(), std::strerror(code)));
}

AuthorityLock::~AuthorityLock() {
  if (fd_ >= 0) ::close(fd_);
}

Expected<Certificate> make_authority_folder(const fs::path& dir, const std::string& name, int64_t days,
                                            int64_t now) {
  KILN_TRY_STATUS(check_days(days));
  KILN_TRY_STATUS(make_private_folder(dir));
  KILN_TRY(const AuthorityLock lock, AuthorityLock::take(dir));
  std::error_code code;
  if (fs::exists(dir / "ca.pem", code) || fs::exists(dir / "ca.key", code))
    return fail(ErrorKind::kUsage,
                text("{} has an authority already; a new one would make every certificate of the "
                     "old one worthless: choose another folder",
                     dir.string()));
  KILN_TRY(const KeyAndCertificate made, make_authority(name, now - kSkew, now + days * kSecondsADay));
  KILN_TRY_STATUS(write_private_file(dir / "ca.key", made.key));
  KILN_TRY_STATUS(write_private_file(
      dir / "revoked", "# Serials of revoked certificates; `kiln cert revoke` adds to them.\n"));
  KILN_TRY_STATUS(write_private_file(dir / "ca.pem", made.certificate));
  return read_certificate(made.certificate);
}

Expected<std::string> sign(const fs::path& dir, const std::string& request, const IssueWish& wish,
                           int64_t now) {
  KILN_TRY(const AuthorityLock lock, AuthorityLock::take(dir));
  return sign_and_note(dir, request, wish, now);
}

Expected<Certificate> issue(const fs::path& dir, const IssueWish& wish, const fs::path& out, int64_t now) {
  const bool coordinator = std::count(wish.roles.begin(), wish.roles.end(), Role::kCoordinator) != 0;
  if (coordinator && wish.hosts.empty())
    return fail(ErrorKind::kUsage,
                "a coordinator's certificate needs the names by which others connect to it: --host "
                "farm.studio.lan,10.0.0.7");
  if (!coordinator && !wish.hosts.empty())
    return fail(ErrorKind::kUsage,
                "--host is for a coordinator's certificate: nobody connects to other roles by host name");
  KILN_TRY(const std::string ca, [&]() -> Expected<std::string> {
    KILN_TRY(const KeyAndCertificate authority, read_authority(dir));
    return authority.certificate;
  }());
  std::error_code code;
  if (fs::exists(out / "key.pem", code))
    return fail(ErrorKind::kUsage,
                text("{} holds a key already: choose another folder with -o", out.string()));
  KILN_TRY(const KeyAndRequest own, make_key_and_request(wish.name));
  KILN_TRY(const std::string certificate, sign(dir, own.request, wish, now));
  KILN_TRY_STATUS(make_private_folder(out));
  KILN_TRY_STATUS(write_private_file(out / "key.pem", own.key));
  KILN_TRY_STATUS(write_private_file(out / "cert.pem", certificate));
  KILN_TRY_STATUS(write_private_file(out / "ca.pem", ca));
  // A coordinator elsewhere begins with the list of today.
  KILN_TRY(const std::string revoked, read_list(dir / "revoked"));
  if (coordinator && !revoked.empty()) KILN_TRY_STATUS(write_private_file(out / "revoked", revoked));
  return read_certificate(certificate);
}

Expected<std::vector<IssuedRecord>> read_issued(const fs::path& dir) {
  KILN_TRY(const std::string list, read_list(dir / "issued"));
  std::vector<IssuedRecord> records;
  std::string_view rest = list;
  for (size_t line = 1; !rest.empty(); ++line) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    auto record = parse_issued(rest.substr(0, end));
    if (!record)
      return fail(ErrorKind::kInvalidInput,
                  text("{}, line {}: {}", (dir / "issued").string(), line, record.error().message));
    records.push_back(std::move(*record));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return records;
}

Status check_new_name(const fs::path& dir, const std::string& name, int64_t now) {
  KILN_TRY(const std::vector<IssuedRecord> issued, read_issued(dir));
  KILN_TRY(const std::string list, read_list(dir / "revoked"));
  KILN_TRY(const auto revoked, parse_revoked(list));
  for (const IssuedRecord& record : issued)
    if (record.name == name && record.not_after >= now && !revoked.count(record.serial))
      return fail(
          ErrorKind::kUsage,
          text("{} has a certificate until {}: join under another name (--name), or have the old one revoked "
               "(`kiln cert revoke {}`)",
               name, date_text(record.not_after), name));
  return {};
}

Expected<std::vector<IssuedRecord>> revoke(const fs::path& dir, const std::string& serial_or_name,
                                           int64_t now) {
  KILN_TRY_STATUS(read_authority(dir).map([](const auto&) {}));
  KILN_TRY(const AuthorityLock lock, AuthorityLock::take(dir));
  KILN_TRY(const std::vector<IssuedRecord> issued, read_issued(dir));
  KILN_TRY(std::string list, read_list(dir / "revoked"));
  KILN_TRY(const auto already, parse_revoked(list));
  std::string serial = serial_or_name;
  std::transform(serial.begin(), serial.end(), serial.begin(),
                 [](char c) { return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c; });
  std::vector<IssuedRecord> revoked;
  bool found = false;
  for (const IssuedRecord& record : issued) {
    if (record.serial != serial && (record.name != serial_or_name || record.not_after < now)) continue;
    found = true;
    if (already.count(record.serial)) continue;
    if (!list.empty() && list.back() != '\n') list += '\n';
    list += text("{}  # {} ({}), {}\n", record.serial, record.name, role_list(record.roles), date_text(now));
    revoked.push_back(record);
  }
  if (!found)
    return fail(ErrorKind::kUsage, text("no certificate of {} has this serial or name; {} lists all of them",
                                        dir.string(), (dir / "issued").string()));
  if (!revoked.empty()) KILN_TRY_STATUS(write_private_file(dir / "revoked", list));
  return revoked;
}

}  // namespace kiln

#include "coordinator/service/audit_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>

#include "common/base/format.h"
#include "coordinator/farm/authority/tokens.h"

namespace kiln {
namespace {

constexpr size_t kMaxShown = 256;

std::string time_text(int64_t unix_ms) {
  const auto seconds = static_cast<std::time_t>(unix_ms / 1000);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char out[32];
  const size_t size = std::strftime(out, sizeof out, "%Y-%m-%dT%H:%M:%S", &utc);
  return text("{}.{:03}Z", std::string(out, size), unix_ms % 1000);
}

void add(std::string& line, const char* name, const std::string& words) {
  line += text(",\"{}\":{}", name, json_quote(words.substr(0, kMaxShown)));
}

void add_whole(std::string& line, const char* name, const JsonValue* value) {
  if (value && value->is_whole) line += text(",\"{}\":{}{}", name, value->negative ? "-" : "", value->whole);
}

// A machine or person that a join token gave a certificate.
void add_enrolment(std::string& line, const JsonValue& document, const JsonValue& reply) {
  if (const JsonValue* typed = document.find("token"))
    if (const auto token = parse_join_token(typed->text)) add(line, "token", token->id);
  const JsonValue* pem = reply.find("certificate");
  const auto made = pem ? read_certificate(pem->text) : fail(ErrorKind::kInvalidInput, "");
  if (!made) return;
  add(line, "name", made->identity.name);
  add(line, "roles", role_list(made->identity.roles));
  add(line, "serial", made->identity.serial);
}

}  // namespace

std::string audit_line(int64_t unix_ms, const Caller& caller, const std::string& verb,
                       const JsonValue& document, const std::string& reply) {
  std::string line = text("{{\"time\":\"{}\"", time_text(unix_ms));
  add(line, "user", caller.user);
  add(line, "access", access_name(caller.access));
  add(line, "peer", caller.peer);
  add(line, "verb", verb);
  const JsonValue answer = parse_json(reply).value_or(JsonValue());
  add_whole(line, "job", answer.find("id"));
  for (const char* name : {"name", "scene", "worker"})
    if (const JsonValue* value = document.find(name); value && value->kind == JsonValue::Kind::kText)
      add(line, name, value->text);
  add_whole(line, "priority", document.find("priority"));
  if (verb == "enrol") add_enrolment(line, document, answer);
  return line + "}\n";
}

std::string revocation_line(int64_t unix_ms, const PeerIdentity& whose, const std::string& peer) {
  std::string line = text("{{\"time\":\"{}\"", time_text(unix_ms));
  add(line, "verb", "revoked");
  add(line, "name", whose.name);
  add(line, "roles", role_list(whose.roles));
  add(line, "serial", whose.serial);
  add(line, "peer", peer);
  return line + "}\n";
}

// Also after a rotation renamed the file: whoever did that finds whole lines there, and the next are
// elsewhere.
Status AuditLog::open() {
  struct stat ours {
  }, there{};
  if (open_.is_open() && ::fstat(open_.number(), &ours) == 0 && ::stat(file_.c_str(), &there) == 0 &&
      ours.st_ino == there.st_ino && ours.st_dev == there.st_dev)
    return {};
  open_ = OpenFile(file_, O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW);
  if (!open_.is_open()) return system_error("open", file_);
  ::fchmod(open_.number(), 0600);
  return sync_folder(real_disk_calls(), file_.parent_path());
}

Status AuditLog::append(const std::string& line) {
  const std::lock_guard lock(mutex_);
  KILN_TRY_STATUS(open());
  struct stat before {};
  if (::fstat(open_.number(), &before) != 0) return system_error("look at", file_);
  char last = '\n';
  if (before.st_size > 0) (void)!::pread(open_.number(), &last, 1, before.st_size - 1);
  // A crash within a line: the next begins its own.
  const std::string bytes = last == '\n' ? line : "\n" + line;
  ssize_t put = -1;
  do put = ::write(open_.number(), bytes.data(), bytes.size());
  while (put < 0 && errno == EINTR);
  if (put == static_cast<ssize_t>(bytes.size()) && ::fdatasync(open_.number()) == 0) return {};
  const int code = put >= 0 && put < static_cast<ssize_t>(bytes.size()) ? ENOSPC : errno;
  (void)!::ftruncate(open_.number(), before.st_size);
  errno = code;
  return system_error("write", file_);
}

}  // namespace kiln

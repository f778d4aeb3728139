#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <ctime>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "coordinator/cli/command.h"
#include "coordinator/farm/authority/authority.h"
#include "coordinator/farm/authority/tokens.h"
#include "coordinator/farm/client/service_client.h"

namespace kiln {
namespace {

constexpr const char* kDefaultFolder = "kiln-ca";
constexpr uint64_t kMaxCertificateBytes = 64 << 10;

int64_t now() {
  return static_cast<int64_t>(std::time(nullptr));
}

std::string host_name() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "machine";
}

std::string folder_of(const Arguments& a) {
  return a.get("dir", kDefaultFolder);
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  for (size_t at = 0; at < list.size();) {
    const size_t end = std::min(list.find(',', at), list.size());
    if (end > at) words.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

Expected<std::vector<Role>> roles_of(const Arguments& a) {
  std::vector<Role> roles;
  for (const std::string& word : split(a.get("role"))) {
    KILN_TRY(const Role role, parse_role(word));
    roles.push_back(role);
  }
  if (roles.empty()) return fail(ErrorKind::kUsage, "say --role: worker, coordinator, read, submit or admin");
  return roles;
}

Expected<int64_t> number_of(const Arguments& a, const std::string& name, int64_t fallback) {
  const std::string typed = a.get(name);
  if (typed.empty()) return fallback;
  int64_t value = 0;
  const auto [stop, code] = std::from_chars(typed.data(), typed.data() + typed.size(), value);
  if (code != std::errc() || stop != typed.data() + typed.size())
    return fail(ErrorKind::kUsage, text("--{} {} is not a whole number", name, typed));
  return value;
}

void write_fields(JsonWriter& w, const Certificate& c) {
  w.pair("name", c.identity.name).pair("serial", c.identity.serial).key("roles").begin_array();
  for (const Role role : c.identity.roles) w.value(role_name(role));
  w.end_array().key("hosts").begin_array();
  for (const std::string& host : c.hosts) w.value(host);
  w.end_array().pair("issuer", c.issuer).pair("authority", c.authority);
  w.pair("not_before", date_text(c.not_before)).pair("not_after", date_text(c.identity.not_after));
  w.pair("sha256", c.fingerprint.hex());
}

void print_certificate(const Arguments& a, const Certificate& c, const std::string& where) {
  if (a.has("json")) {
    JsonWriter w;
    w.begin_object().pair("path", where);
    write_fields(w, c);
    std::fputs(w.end_object().take().c_str(), stdout);
    return;
  }
  std::string hosts;
  for (const std::string& host : c.hosts) hosts += (hosts.empty() ? "" : ", ") + host;
  std::printf("%s\n  name     %s\n  %s\n", where.c_str(), c.identity.name.c_str(),
              c.authority ? "authority of a farm" : ("roles    " + role_list(c.identity.roles)).c_str());
  if (!hosts.empty()) std::printf("  hosts    %s\n", hosts.c_str());
  std::printf("  issuer   %s\n  serial   %s\n  valid    %s to %s%s\n  sha256   %s\n", c.issuer.c_str(),
              c.identity.serial.c_str(), date_text(c.not_before).c_str(),
              date_text(c.identity.not_after).c_str(),
              c.identity.not_after < now() ? " (expired)"
              : c.not_before > now()       ? " (not yet)"
                                           : "",
              c.fingerprint.hex().c_str());
}

Status make_ca(const Arguments& a) {
  KILN_TRY(const int64_t days, number_of(a, "days", 3650));
  KILN_TRY(const Certificate c, make_authority_folder(folder_of(a), a.get("name", "kiln"), days, now()));
  print_certificate(a, c, folder_of(a) + "/ca.pem");
  return {};
}

Status issue_certificate(const Arguments& a) {
  KILN_TRY(std::vector<Role> roles, roles_of(a));
  KILN_TRY(const int64_t days, number_of(a, "days", 365));
  const std::string name = a.get("name");
  if (!is_certificate_name(name))
    return fail(ErrorKind::kUsage,
                "say --name: the machine's or the person's, of letters, digits, dots, dashes and "
                "underscores");
  const std::string out = a.get("output", name);
  KILN_TRY(const Certificate c,
           issue(folder_of(a), {name, std::move(roles), split(a.get("host")), days}, out, now()));
  print_certificate(a, c, out + "/cert.pem");
  return {};
}

Status show(const Arguments& a) {
  const std::string file = a.get("what");
  if (file.empty()) return fail(ErrorKind::kUsage, "say which file: kiln cert show render7/cert.pem");
  KILN_TRY(const Bytes bytes, read_file(file, kMaxCertificateBytes));
  const auto c = read_certificate({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!c) return fail(c.error().kind, text("{} {}", file, c.error().message));
  print_certificate(a, *c, file);
  return {};
}

Status revoke_certificate(const Arguments& a) {
  if (a.get("what").empty())
    return fail(ErrorKind::kUsage, "say whose: kiln cert revoke render7, or a serial number");
  KILN_TRY(const std::vector<IssuedRecord> revoked, revoke(folder_of(a), a.get("what"), now()));
  if (a.has("json")) {
    JsonWriter w;
    w.begin_object().key("revoked").begin_array();
    for (const IssuedRecord& r : revoked)
      w.begin_object().pair("serial", r.serial).pair("name", r.name).end_object();
    std::fputs(w.end_array().end_object().take().c_str(), stdout);
    return {};
  }
  for (const IssuedRecord& r : revoked)
    std::printf("revoked  %s  %s (%s)\n", r.serial.c_str(), r.name.c_str(), role_list(r.roles).c_str());
  if (revoked.empty()) std::printf("nothing changed: it was revoked before\n");
  const std::string list = folder_of(a) + "/revoked";
  std::printf(
      "A coordinator started with --authority %s, or with --ca %s/ca.pem, has heard it.\nFor one elsewhere "
      "copy "
      "%s beside its ca.pem.\n",
      folder_of(a).c_str(), folder_of(a).c_str(), list.c_str());
  return {};
}

Status print_token(const Arguments& a) {
  KILN_TRY(const std::vector<Role> roles, roles_of(a));
  if (roles.size() != 1) return fail(ErrorKind::kUsage, "a join token has one role");
  KILN_TRY(const int64_t uses, number_of(a, "uses", 1));
  KILN_TRY(const int64_t hours, number_of(a, "hours", 24));
  if (uses < 1 || uses > 10'000) return fail(ErrorKind::kUsage, "a join token has 1 to 10000 uses");
  KILN_TRY(const JoinToken token,
           make_token(folder_of(a), roles[0], static_cast<uint32_t>(uses), hours, now()));
  if (a.has("json")) {
    JsonWriter w;
    w.begin_object().pair("token", token.text()).pair("role", role_name(roles[0])).pair("uses", uses);
    std::fputs(w.pair("hours", hours).end_object().take().c_str(), stdout);
  } else {
    std::printf("%s\n", token.text().c_str());
  }
  return {};
}

// A machine without a certificate asks the coordinator for one; the key never leaves the machine.
Status join_farm(const Arguments& a) {
  if (a.get("token-file").empty() || a.get("server").empty())
    return fail(ErrorKind::kUsage,
                "say where and by what: kiln cert join --server HOST:PORT --token-file FILE, with the line "
                "that `kiln cert "
                "token` printed");
  KILN_TRY(const Bytes bytes, read_file(a.get("token-file"), 4096));
  std::string words(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  words.erase(words.find_last_not_of(" \r\n") + 1);
  KILN_TRY(const JoinToken token, parse_join_token(words));
  const std::string name = a.get("name", host_name());
  const std::filesystem::path folder = a.get("output", name);
  std::error_code code;
  if (std::filesystem::exists(folder / "key.pem", code))
    return fail(ErrorKind::kUsage,
                text("{} holds a key already: give another folder with -o", folder.string()));
  KILN_TRY(const KeyAndRequest made, make_key_and_request(name));
  ClientOptions options;
  options.server = a.get("server");
  options.join = token.authority;
  KILN_TRY(const auto client, ServiceClient::connect(options));
  const std::string ask =
      JsonWriter().begin_object().pair("token", words).pair("request", made.request).end_object().take();
  KILN_TRY(const std::string reply, client->call("enrol", ask));
  KILN_TRY(const JsonValue root, parse_json(reply));
  const JsonValue* certificate = root.find("certificate");
  const JsonValue* authority = root.find("authority");
  if (!certificate || !authority) return fail(ErrorKind::kProtocol, "the coordinator sent no certificate");
  std::filesystem::create_directories(folder, code);
  if (code) return fail(ErrorKind::kIo, text("{}: {}", folder.string(), code.message()));
  KILN_TRY_STATUS(write_private_file(folder / "key.pem", made.key));
  KILN_TRY_STATUS(write_file_atomic(folder / "cert.pem", std::string_view(certificate->text)));
  KILN_TRY_STATUS(write_file_atomic(folder / "ca.pem", std::string_view(authority->text)));
  std::printf("joined as %s: %s holds cert.pem, key.pem and ca.pem\n", name.c_str(), folder.c_str());
  return {};
}

int run(const Arguments& a, const BakeSettings&) {
  static const std::pair<const char*, Status (*)(const Arguments&)> kActions[] = {
      {"ca", make_ca},        {"issue", issue_certificate}, {"show", show}, {"revoke", revoke_certificate},
      {"token", print_token}, {"join", join_farm}};
  for (const auto& [name, action] : kActions)
    if (a.get("action") == name) {
      const Status done = action(a);
      return done ? 0 : report_error(done.error());
    }
  return report_error(
      {ErrorKind::kUsage, text("cert {}: one of ca, issue, show, revoke, token, join", a.get("action"))});
}

}  // namespace

Command cert_command() {
  return {"cert",
          "Manage a farm's certificates: the authority, certificates of machines and users, join tokens",
          "kiln cert ca\n  kiln cert issue --role coordinator --name farm --host farm.studio.lan,10.0.0.7\n"
          "  kiln cert issue --role worker --name render7\n  kiln cert issue --role read,submit --name ada\n"
          "  kiln cert show render7/cert.pem\n  kiln cert revoke render7\n"
          "  kiln cert token --role worker --uses 20 --hours 48 > join.token\n"
          "  kiln cert join --server farm.studio.lan:7800 --token-file join.token",
          {{"action", "ACTION", "ca, issue, show, revoke, token or join", true},
           {"what", "WHAT", "show: the file; revoke: a serial number, or a name for all its certificates"},
           {"--dir", "DIR", "the authority's folder [kiln-ca]"},
           {"--role", "ROLES",
            "issue: worker, coordinator, read, submit, admin, separated by commas; token: one of them"},
           {"--name", "NAME", "issue: name of the machine or user; ca: name of the farm"},
           {"--host", "HOSTS",
            "issue, coordinator: host names and addresses that others connect to, separated by commas"},
           {"--days", "N", "ca, issue: days of validity [3650; 365]"},
           {"--uses", "N", "token: number of machines it admits [1]"},
           {"--hours", "H", "token: hours of validity [24]"},
           {"--server", "HOST:PORT", "join: the coordinator"},
           {"--token-file", "FILE", "join: file with the line that `token` printed"},
           {"-o,--output", "FOLDER", "issue, join: folder for cert.pem, key.pem and ca.pem [the name]"},
           {"--json", "", "print JSON"}},
          false,
          run};
}

}  // namespace kiln

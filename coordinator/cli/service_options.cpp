#include "coordinator/cli/service_options.h"

#include <charconv>
#include <ctime>

#include "common/base/format.h"
#include "common/base/printable.h"

namespace kiln {

std::vector<Option> with_service_options(std::vector<Option> own) {
  for (Option option : std::vector<Option>{
           {"--server", "HOST:PORT", "the coordinator; or KILN_SERVER [127.0.0.1:7800]"},
           {"--token-file", "FILE",
            "file with the token of a coordinator without TLS; or KILN_TOKEN_FILE, KILN_TOKEN"},
           {"--ca", "FILE", "the farm's authority; or KILN_CA"},
           {"--certificate", "FILE", "your certificate; or KILN_CERTIFICATE"},
           {"--key", "FILE", "its key; or KILN_KEY"},
           {"--json", "", "print JSON"}})
    own.push_back(std::move(option));
  return own;
}

Expected<std::unique_ptr<ServiceClient>> connect_service(const Arguments& a) {
  KILN_TRY(const ClientOptions options, client_options({a.get("server"), a.get("token-file"), a.get("ca"),
                                                        a.get("certificate"), a.get("key")}));
  return ServiceClient::connect(options);
}

Expected<int64_t> parse_whole(const std::string& name, const std::string& typed, int64_t least,
                              int64_t most) {
  int64_t value = 0;
  const auto [stop, code] = std::from_chars(typed.data(), typed.data() + typed.size(), value);
  if (code != std::errc() || stop != typed.data() + typed.size() || value < least || value > most)
    return fail(ErrorKind::kUsage,
                text("{} {} is not a whole number from {} to {}", name, typed, least, most));
  return value;
}

Expected<uint64_t> parse_id(const std::string& typed) {
  KILN_TRY(const int64_t id, parse_whole("job", typed, 1, int64_t{1} << 62));
  return static_cast<uint64_t>(id);
}

std::string id_document(uint64_t id) {
  return JsonWriter().begin_object().pair("id", id).end_object().take();
}

std::string text_of(const JsonValue& value, const char* name) {
  const JsonValue* member = value.find(name);
  return member ? printable(member->text) : "";
}
double number_of(const JsonValue& value, const char* name) {
  const JsonValue* member = value.find(name);
  return member ? member->number : 0;
}
uint64_t whole_of(const JsonValue& value, const char* name) {
  const JsonValue* member = value.find(name);
  return member ? member->whole : 0;
}
bool flag_of(const JsonValue& value, const char* name) {
  const JsonValue* member = value.find(name);
  return member && member->flag;
}

std::string time_text(uint64_t unix_ms) {
  if (unix_ms == 0) return "-";
  const auto seconds = static_cast<std::time_t>(unix_ms / 1000);
  std::tm local{};
  ::localtime_r(&seconds, &local);
  char out[32];
  return std::strftime(out, sizeof out, "%Y-%m-%d %H:%M", &local) ? out : "-";
}

int status_of_state(const std::string& state) {
  return state == "done" ? 0 : 1;
}

}  // namespace kiln

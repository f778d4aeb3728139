#include <cstdio>

#include "common/base/format.h"
#include "common/base/printable.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

// "12", "12/77" or "worker NAME".
Expected<std::string> question(const Arguments& a) {
  const std::string what = a.get("what");
  JsonWriter w;
  w.begin_object();
  if (what == "worker") {
    if (!a.has("name")) return fail(ErrorKind::kUsage, "say which: kiln why worker NAME");
    return w.pair("worker", a.get("name")).end_object().take();
  }
  const size_t slash = what.find('/');
  KILN_TRY(const uint64_t job, parse_id(what.substr(0, slash)));
  w.pair("job", job);
  if (slash != std::string::npos) {
    KILN_TRY(const int64_t unit, parse_whole("unit", what.substr(slash + 1), 0, int64_t{1} << 62));
    w.pair("unit", unit);
  }
  return w.end_object().take();
}

int run(const Arguments& a, const BakeSettings&) {
  const Status s = [&]() -> Status {
    KILN_TRY(const std::string document, question(a));
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    KILN_TRY(const std::string reply, client->call("why", document));
    if (a.has("json")) {
      std::fputs(reply.c_str(), stdout);
      return {};
    }
    KILN_TRY(const JsonValue answer, parse_json(reply));
    if (const JsonValue* lines = answer.find("why"))
      for (const JsonValue& line : lines->items) std::printf("%s\n", printable(line.text).c_str());
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command why_command() {
  return {"why",
          "Explain which rule applies to a job, a unit or a worker right now, with its numbers",
          "kiln why 12\n  kiln why 12/77\n  kiln why worker render7",
          with_service_options({{"what", "WHAT", "JOB, JOB/UNIT, or the word worker", true},
                                {"name", "NAME", "the worker's name or number"}}),
          false,
          run};
}

}  // namespace kiln

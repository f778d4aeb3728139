// cancel, pause, resume, retry, forget and priority: one request about one job.
#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

int ask(const Arguments& a, const std::string& verb, const std::string& said) {
  const Status s = [&]() -> Status {
    KILN_TRY(const uint64_t id, parse_id(a.get("id")));
    JsonWriter w;
    w.begin_object().pair("id", id);
    if (verb == "priority") {
      KILN_TRY(const int64_t priority, parse_whole("priority", a.get("value"), -100, 100));
      w.pair("priority", priority);
    }
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    KILN_TRY(const std::string reply, client->call(verb, w.end_object().take()));
    if (a.has("json"))
      std::fputs(reply.c_str(), stdout);
    else
      std::printf("job %llu %s\n", static_cast<unsigned long long>(id), said.c_str());
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

Command change(const std::string& verb, const std::string& about, const std::string& said) {
  std::vector<Option> options{{"id", "ID", "the job's number", true}};
  if (verb == "priority")
    options.push_back({"value", "P", "-100 to 100; put -- before a negative value", true});
  return {verb,
          about,
          verb == "priority" ? "kiln priority 12 50" : "kiln " + verb + " 12",
          with_service_options(std::move(options)),
          false,
          [verb, said](const Arguments& a, const BakeSettings&) { return ask(a, verb, said); }};
}

}  // namespace

std::vector<Command> change_commands() {
  return {change("cancel", "Cancel a job that has not ended, and drop its results", "is being cancelled"),
          change("pause", "Stop handing out a job's units, or hold it in the queue", "is paused"),
          change("resume", "Resume a paused job", "is resumed"),
          change("retry", "Queue a failed or cancelled job again; stored unit results are reused",
                 "is queued again"),
          change("priority", "Change a job's priority", "has its new priority"),
          change("forget", "Remove an ended job and its results", "is forgotten")};
}

}  // namespace kiln

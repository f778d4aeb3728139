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

int retry_suspects(const Arguments& a) {
  const Status s = [&]() -> Status {
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    const std::string name = a.get("worker");
    KILN_TRY(const std::string reply,
             client->call("retry", JsonWriter().begin_object().pair("suspect", name).end_object().take()));
    if (a.has("json")) {
      std::fputs(reply.c_str(), stdout);
      return {};
    }
    KILN_TRY(const JsonValue answer, parse_json(reply));
    const JsonValue* ids = answer.find("ids");
    if (!ids || ids->items.empty()) std::printf("no job of yours was published with suspect results\n");
    if (ids)
      for (const JsonValue& id : ids->items) std::printf("job %.0f is queued again\n", id.number);
    if (const uint64_t others = whole_of(answer, "of_others"))
      std::printf("%llu jobs of others are left to them, or to an admin\n",
                  static_cast<unsigned long long>(others));
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

Command retry_command() {
  return {"retry",
          "Queue a failed, cancelled or tainted job again; stored unit results are reused",
          "kiln retry 12\n  kiln retry --suspect\n  kiln retry --suspect --worker render7",
          with_service_options(
              {{"id", "ID", "the job's number"},
               {"--suspect", "",
                "instead of ID: all jobs published with results that only a quarantined worker gave"},
               {"--worker", "NAME", "with --suspect: of this worker"}}),
          false,
          [](const Arguments& a, const BakeSettings&) {
            if (a.has("suspect") != a.has("id"))
              return a.has("suspect") ? retry_suspects(a) : ask(a, "retry", "is queued again");
            return report_error(Error{ErrorKind::kUsage, "give a job's number or --suspect"});
          }};
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
          retry_command(),
          change("priority", "Change a job's priority", "has its new priority"),
          change("forget", "Remove an ended job and its results", "is forgotten")};
}

}  // namespace kiln

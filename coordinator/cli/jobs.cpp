#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

std::string state_text(const JsonValue& job) {
  std::string state = text_of(job, "state");
  if (flag_of(job, "paused")) state += ", paused";
  if (flag_of(job, "tainted")) state += ", tainted";
  return state;
}

std::string progress_text(const JsonValue& job) {
  const JsonValue* p = job.find("progress");
  if (!p) return "";
  if (text_of(*p, "stage") != "bake") return text_of(*p, "stage");
  return text("pass {}/{} {:.0f} %", whole_of(*p, "pass"), whole_of(*p, "passes"),
              100 * number_of(*p, "pass_share"));
}

void print_table(const JsonValue& document) {
  const JsonValue* jobs = document.find("jobs");
  if (!jobs || jobs->items.empty()) {
    std::printf("no jobs\n");
    return;
  }
  std::printf("%6s  %-18s %-20.20s %-12s %4s  %-16s  %s\n", "job", "state", "name", "user", "prio",
              "submitted", "");
  for (const JsonValue& job : jobs->items) {
    const std::string about = progress_text(job).empty() ? text_of(job, "reason") : progress_text(job);
    std::printf("%6llu  %-18s %-20.20s %-12.12s %4.0f  %-16s  %s\n",
                static_cast<unsigned long long>(whole_of(job, "id")), state_text(job).c_str(),
                text_of(job, "name").c_str(), text_of(job, "user").c_str(), number_of(job, "priority"),
                time_text(whole_of(job, "submitted_ms")).c_str(), about.c_str());
  }
  if (flag_of(document, "more")) std::printf("older jobs are not shown (--most N lists up to 1000)\n");
}

void print_job(const JsonValue& job) {
  std::printf("job %llu '%s' of %s: %s\n", static_cast<unsigned long long>(whole_of(job, "id")),
              text_of(job, "name").c_str(), text_of(job, "user").c_str(), state_text(job).c_str());
  for (const char* name : {"reason", "taint", "verification", "numeric_class"})
    if (!text_of(job, name).empty()) std::printf("%-12s %s\n", name, text_of(job, name).c_str());
  std::printf("submitted    %s\nstarted      %s\nended        %s\n",
              time_text(whole_of(job, "submitted_ms")).c_str(),
              time_text(whole_of(job, "started_ms")).c_str(), time_text(whole_of(job, "ended_ms")).c_str());
  if (!progress_text(job).empty()) std::printf("now          %s\n", progress_text(job).c_str());
  if (const JsonValue* results = job.find("results"))
    for (const JsonValue& file : results->items)
      std::printf("result       %-24s %12llu bytes\n", text_of(file, "path").c_str(),
                  static_cast<unsigned long long>(whole_of(file, "size")));
  if (const JsonValue* events = job.find("events"))
    for (const JsonValue& event : events->items)
      std::printf("%s  %s\n", time_text(whole_of(event, "at_ms")).c_str(), text_of(event, "text").c_str());
}

Status show(const Arguments& a) {
  const bool one = a.has("id");
  std::string document;
  if (one) {
    KILN_TRY(const uint64_t id, parse_id(a.get("id")));
    document = id_document(id);
  } else {
    KILN_TRY(const int64_t most, parse_whole("--most", a.get("most", "200"), 1, 1000));
    document = JsonWriter().begin_object().pair("most", most).end_object().take();
  }
  KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
  KILN_TRY(const std::string reply, client->call(one ? "job" : "jobs", document));
  if (a.has("json")) {
    std::fputs(reply.c_str(), stdout);
    return {};
  }
  KILN_TRY(const JsonValue answer, parse_json(reply));
  one ? print_job(answer) : print_table(answer);
  return {};
}

int run(const Arguments& a, const BakeSettings&) {
  const Status s = show(a);
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command jobs_command() {
  return {
      "jobs",
      "List the jobs in a coordinator's queue, or show one in detail",
      "kiln jobs\n  kiln jobs 12",
      with_service_options({{"id", "ID", "a job's number"}, {"--most", "N", "list the newest N jobs [200]"}}),
      false,
      run};
}

}  // namespace kiln

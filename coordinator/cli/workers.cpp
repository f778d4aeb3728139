#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

void print_quarantined(const JsonValue& worker) {
  const std::string name = text_of(worker, "identity");
  std::printf("quarantined: %s: %s (kiln workers --forgive '%s')\n", name.c_str(),
              text_of(worker, "reason").c_str(), name.c_str());
  const JsonValue* jobs = worker.find("suspect_jobs");
  if (!jobs || jobs->items.empty()) return;
  std::printf("  published with results that it alone gave:");
  for (const JsonValue& job : jobs->items) std::printf(" %.0f", job.number);
  std::printf(" (bake them again: kiln retry --suspect --worker '%s')\n", name.c_str());
}

void print_workers(const JsonValue& answer) {
  if (const JsonValue* workers = answer.find("workers")) {
    if (workers->items.empty()) std::printf("no workers are connected\n");
    for (const JsonValue& w : workers->items)
      std::printf("%-40s %-10s %3.0f threads  job %-5llu %6llu units  %8.2f M rays/s  %llu agreed\n",
                  text_of(w, "name").c_str(), text_of(w, "state").c_str(), number_of(w, "threads"),
                  static_cast<unsigned long long>(whole_of(w, "job")),
                  static_cast<unsigned long long>(whole_of(w, "units_done")),
                  number_of(w, "rays_per_second") / 1e6,
                  static_cast<unsigned long long>(whole_of(w, "agreed")));
  }
  if (const JsonValue* out = answer.find("quarantined"))
    for (const JsonValue& w : out->items) print_quarantined(w);
}

int run(const Arguments& a, const BakeSettings&) {
  const Status s = [&]() -> Status {
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    const std::string forgiven = a.get("forgive");
    KILN_TRY(const std::string reply,
             forgiven.empty()
                 ? client->call("workers", "{}")
                 : client->call("forgive",
                                JsonWriter().begin_object().pair("worker", forgiven).end_object().take()));
    if (a.has("json")) {
      std::fputs(reply.c_str(), stdout);
      return {};
    }
    if (!forgiven.empty()) {
      std::printf("%s is forgiven: start it again\n", forgiven.c_str());
      return {};
    }
    KILN_TRY(const JsonValue answer, parse_json(reply));
    print_workers(answer);
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command workers_command() {
  return {"workers",
          "List a coordinator's workers, including quarantined ones",
          "kiln workers\n  kiln workers --forgive render7",
          with_service_options(
              {{"--forgive", "NAME", "end a worker's quarantine; it starts again without trust"}}),
          false,
          run};
}

}  // namespace kiln

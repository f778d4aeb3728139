#include <cstdio>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

std::string size_text(double bytes) {
  const char* sign = bytes < 0 ? "-" : "";
  double size = bytes < 0 ? -bytes : bytes;
  const char* unit = "B";
  for (const char* next : {"KiB", "MiB", "GiB", "TiB"}) {
    if (size < 1024) break;
    size /= 1024;
    unit = next;
  }
  return text("{}{:.1f} {}", sign, size, unit);
}

void print_data(const JsonValue& data) {
  const JsonValue *sizes = data.find("size_bytes"), *growth = data.find("growth_bytes_a_day");
  if (sizes)
    for (const JsonMember& kind : sizes->members)
      std::printf(
          "%-12s %12s%s\n", kind.first.c_str(), size_text(kind.second.number).c_str(),
          growth ? text("  {:>12} a day", size_text(number_of(*growth, kind.first.c_str()))).c_str() : "");
  if (sizes && !growth) std::printf("growth is known after an hour of observation\n");
  std::printf("disk         %s free of %s", size_text(number_of(data, "free_bytes")).c_str(),
              size_text(number_of(data, "disk_bytes")).c_str());
  if (data.find("days_until_full")) std::printf(", full in %.1f days", number_of(data, "days_until_full"));
  std::printf("\n");
  if (const JsonValue* r = data.find("retention")) {
    const JsonValue* jobs = r->find("next_jobs");
    const size_t count = jobs ? jobs->items.size() : 0;
    if (whole_of(*r, "next_ms"))
      std::printf("retention    %llu days; from %s on %zu jobs with %s of files are forgotten: job %.0f%s\n",
                  static_cast<unsigned long long>(whole_of(*r, "keep_days")),
                  time_text(whole_of(*r, "next_ms")).c_str(), count,
                  size_text(number_of(*r, "next_bytes")).c_str(), count ? jobs->items.front().number : 0.0,
                  count > 1 ? " and others" : "");
    else
      std::printf("retention    %llu days; no job has ended\n",
                  static_cast<unsigned long long>(whole_of(*r, "keep_days")));
  }
  if (const JsonValue* backup = data.find("backup"))
    std::printf("backup       %s\n", whole_of(*backup, "last_ms")
                                         ? text("{} jobs at {}", whole_of(*backup, "jobs"),
                                                time_text(whole_of(*backup, "last_ms")))
                                               .c_str()
                                         : "none is known: kiln backup");
}

void print_status(const JsonValue& answer) {
  std::printf("release      %s, clients %llu\n", text_of(answer, "release").c_str(),
              static_cast<unsigned long long>(whole_of(answer, "clients")));
  for (const char* name : {"held_for", "clock_doubt"})
    if (!text_of(answer, name).empty()) std::printf("%-12s %s\n", name, text_of(answer, name).c_str());
  if (const JsonValue* jobs = answer.find("jobs")) {
    std::printf("jobs        ");
    bool any = false;
    for (const JsonMember& state : jobs->members)
      if (state.second.whole) {
        std::printf(" %llu %s", static_cast<unsigned long long>(state.second.whole), state.first.c_str());
        any = true;
      }
    std::printf(any ? "\n" : " none\n");
  }
  std::printf("workers      %llu with %llu threads, %.2f M rays/s, %llu quarantined\n",
              static_cast<unsigned long long>(whole_of(answer, "workers")),
              static_cast<unsigned long long>(whole_of(answer, "threads")),
              number_of(answer, "rays_per_second") / 1e6,
              static_cast<unsigned long long>(whole_of(answer, "quarantined")));
  if (whole_of(answer, "certificate_until_s"))
    std::printf("certificate  until %s\n", time_text(1000 * whole_of(answer, "certificate_until_s")).c_str());
  if (const JsonValue* data = answer.find("data")) print_data(*data);
}

int run(const Arguments& a, const BakeSettings&) {
  const Status s = [&]() -> Status {
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    KILN_TRY(const std::string reply, client->call("status", "{}"));
    if (a.has("json")) {
      std::fputs(reply.c_str(), stdout);
      return {};
    }
    KILN_TRY(const JsonValue answer, parse_json(reply));
    print_status(answer);
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command status_command() {
  return {"status",
          "Show a coordinator's state: jobs, workers, how its data grows, what is deleted next",
          "kiln status\n  kiln status --json",
          with_service_options({}),
          false,
          run};
}

}  // namespace kiln

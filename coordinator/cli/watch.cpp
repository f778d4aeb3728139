#include <unistd.h>

#include <cstdio>
#include <map>
#include <thread>

#include "common/base/format.h"
#include "coordinator/cli/progress.h"
#include "coordinator/cli/service_options.h"

namespace kiln {
namespace {

constexpr auto kPause = std::chrono::milliseconds(500);

std::string job_line(const JsonValue& job) {
  std::string line = text("job {} {}: {}", whole_of(job, "id"), text_of(job, "name"), text_of(job, "state"));
  if (flag_of(job, "paused")) line += ", paused";
  const JsonValue* p = job.find("progress");
  if (!p) return text_of(job, "reason").empty() ? line : line + ", " + text_of(job, "reason");
  if (text_of(*p, "stage") != "bake") return line + ", " + text_of(*p, "stage");
  line +=
      text(", pass {}, {:.0f} %, {:.1f} % of texels converged, {} workers, {:.2f} M rays/s",
           whole_of(*p, "pass"), 100 * number_of(*p, "pass_share"), 100 * number_of(job, "converged_share"),
           whole_of(*p, "workers"), number_of(*p, "rays_per_second") / 1e6);
  if (number_of(*p, "seconds_left") >= 0)
    line += text(", about {} left", duration_text(number_of(*p, "seconds_left")));
  return line + (text_of(job, "reason").empty() ? "" : ", " + text_of(job, "reason"));
}

// Rewrites its lines on a terminal; elsewhere prints a line when the state or the pass changes.
class Screen {
 public:
  void show(const std::vector<const JsonValue*>& jobs) {
    if (!terminal_) return log(jobs);
    if (lines_) std::printf("\033[%zuA", lines_);
    for (const JsonValue* job : jobs) std::printf("\r\033[K%s\n", job_line(*job).c_str());
    for (size_t i = jobs.size(); i < lines_; ++i) std::printf("\r\033[K\n");
    lines_ = std::max(lines_, jobs.size());
    std::fflush(stdout);
  }

 private:
  void log(const std::vector<const JsonValue*>& jobs) {
    for (const JsonValue* job : jobs) {
      const JsonValue* p = job->find("progress");
      const std::string key = text("{} {} {} {}", text_of(*job, "state"), flag_of(*job, "paused"),
                                   p ? whole_of(*p, "pass") : 0, text_of(*job, "reason"));
      if (std::exchange(said_[whole_of(*job, "id")], key) == key) continue;
      std::printf("%s\n", job_line(*job).c_str());
    }
    std::fflush(stdout);
  }
  const bool terminal_ = ::isatty(STDOUT_FILENO);
  size_t lines_ = 0;
  std::map<uint64_t, std::string> said_;
};

bool has_ended(const std::string& state) {
  return state == "done" || state == "failed" || state == "cancelled";
}

}  // namespace

Expected<int> watch_jobs(ServiceClient& client, uint64_t id, bool json) {
  Screen screen;
  for (;; std::this_thread::sleep_for(kPause)) {
    KILN_TRY(const std::string reply,
             id ? client.call("job", id_document(id)) : client.call("jobs", R"({"most": 20})"));
    KILN_TRY(const JsonValue answer, parse_json(reply));
    std::vector<const JsonValue*> shown;
    if (id) {
      shown.push_back(&answer);
    } else if (const JsonValue* jobs = answer.find("jobs")) {
      for (const JsonValue& job : jobs->items)
        if (!has_ended(text_of(job, "state"))) shown.push_back(&job);
    }
    if (!json) screen.show(shown);
    const std::string state = text_of(answer, "state");
    if (id ? !has_ended(state) : !shown.empty()) continue;
    if (json) std::fputs(reply.c_str(), stdout);
    if (!id) return 0;
    if (state != "done")
      std::fprintf(stderr, "kiln: job %llu is %s: %s\n", static_cast<unsigned long long>(id), state.c_str(),
                   text_of(answer, "reason").c_str());
    return status_of_state(state);
  }
}

namespace {

int run(const Arguments& a, const BakeSettings&) {
  const auto status = [&]() -> Expected<int> {
    uint64_t id = 0;
    if (a.has("id")) {
      KILN_TRY(id, parse_id(a.get("id")));
    }
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    return watch_jobs(*client, id, a.has("json"));
  }();
  return status ? *status : report_error(status.error());
}

}  // namespace

Command watch_command() {
  return {"watch",
          "Follow one job, or all jobs, until none is running; the exit status is the job's outcome",
          "kiln watch 12",
          with_service_options({{"id", "ID", "a job's number"}}),
          false,
          run};
}

}  // namespace kiln

#include "coordinator/service/scene_check.h"

#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "common/base/clock.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/farm/dispatch/child_process.h"
#include "coordinator/service/job_settings.h"

namespace kiln {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr std::string_view kHead = "kiln: ";

// 0 when it has ended.
uint64_t resident_bytes(pid_t process) {
  std::ifstream statm(text("/proc/{}/statm", process));
  uint64_t all = 0, resident = 0;
  statm >> all >> resident;
  return statm ? resident * static_cast<uint64_t>(::sysconf(_SC_PAGE_SIZE)) : 0;
}

// What the child says on standard error: a line of its own, which read_lines() cuts where it is long.
class LastWords {
 public:
  void add(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      if (line.starts_with(kHead))
        sentence_ = line.substr(kHead.size());
      else if (!sentence_.empty() && sentence_.size() < kMost)
        sentence_ += line;
    }
  }
  const std::string& sentence() const { return sentence_; }

 private:
  static constexpr size_t kMost = 4000;
  std::string sentence_;
};

tl::unexpected<Error> too_much_memory(const std::filesystem::path& scene, const PrepareLimits& limits) {
  return fail(
      ErrorKind::kInvalidInput,
      text("{}: to import it and lay out its lightmap takes more than the {} MiB of memory that a job may "
           "take: simplify the scene, lower --texels-per-metre, or give `kiln serve` a larger "
           "--prepare-memory",
           scene.filename().string(), limits.memory_bytes >> 20));
}

Status judge(const ChildProcess& child, const LastWords& words, const std::filesystem::path& scene,
             const PrepareLimits& limits) {
  if (child.exited_with(0)) return {};
  if (child.exited_with(kCheckNoMemory)) return too_much_memory(scene, limits);
  for (const auto& [status, kind] :
       {std::pair{2, ErrorKind::kInvalidInput}, {1, ErrorKind::kIo}, {4, ErrorKind::kTooShort}})
    if (child.exited_with(status) && !words.sentence().empty()) return fail(kind, words.sentence());
  return fail(
      ErrorKind::kInternal,
      text("{}: the process that imports it and lays out its lightmap ended with {}{}{}; the coordinator "
           "goes on. If the machine was short of memory, `kiln retry` tries it again",
           scene.filename().string(), child.how_it_ended(), words.sentence().empty() ? "" : ": ",
           words.sentence()));
}

}  // namespace

Status check_scene_apart(const std::string& program, const std::filesystem::path& scene,
                         const BakeSettings& settings, const std::filesystem::path& folder,
                         const PrepareLimits& limits, const std::atomic<bool>& stop) {
  const std::filesystem::path config = folder / "settings.json";
  KILN_TRY_STATUS(write_file_atomic(config, write_job_settings(settings)));
  KILN_TRY(ChildProcess child, ChildProcess::spawn({program, kCheckVerb, scene.string(), "--settings",
                                                    config.string(), "--unwrap-cache", settings.unwrap_cache,
                                                    "--memory-mib", text("{}", limits.memory_bytes >> 20)},
                                                   {text("KILN_PARENT={}", ::getpid())}));
  const SteadyClock clock;
  const int64_t end = clock.now_ms() + limits.ms;
  LastWords words;
  while (child.running()) {
    words.add(child.read_lines());
    // On return the child is killed.
    if (stop) return fail(ErrorKind::kUnavailable, "the job was stopped");
    if (resident_bytes(child.pid()) > limits.memory_bytes) return too_much_memory(scene, limits);
    if (clock.now_ms() >= end)
      return fail(
          ErrorKind::kInvalidInput,
          text("{}: to import it and lay out its lightmap takes more than the {} s that a job may take: "
               "simplify the scene, lower --texels-per-metre, or give `kiln serve` a larger "
               "--prepare-time",
               scene.filename().string(), limits.ms / 1000));
    std::this_thread::sleep_for(kPoll);
  }
  words.add(child.read_lines());
  return judge(child, words, scene, limits);
}

}  // namespace kiln

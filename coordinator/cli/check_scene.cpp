// What `kiln serve` runs for a job before it prepares the job itself (coordinator/service/scene_check.h).
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <new>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/run/workplace.h"
#include "coordinator/service/job_settings.h"
#include "coordinator/service/scene_check.h"

namespace kiln {
namespace {

constexpr uint64_t kStack = uint64_t{16} << 20;  // of a thread, with its allocator's start

void die_with_parent() {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const char* const parent = std::getenv("KILN_PARENT");
  if (parent && std::to_string(::getppid()) != parent) std::_Exit(1);  // it has died already
}

// Private data rather than address space: libraries and allocators reserve much more than they use.
Status limit_memory(uint64_t bytes) {
  const rlim_t most = bytes + kStack * (hardware_threads() + 1);
  const rlimit limit{most, most};
  if (::setrlimit(RLIMIT_DATA, &limit) != 0)
    return fail(ErrorKind::kIo, text("cannot limit the memory to {} MiB", bytes >> 20));
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  std::set_new_handler([] { std::_Exit(kCheckNoMemory); });
  return {};
}

Status check(const Arguments& a) {
  KILN_TRY(const int64_t mib, parse_whole("--memory-mib", a.get("memory-mib"), 1, int64_t{1} << 40));
  KILN_TRY_STATUS(limit_memory(static_cast<uint64_t>(mib) << 20));
  KILN_TRY(const Bytes bytes, read_file(a.get("settings")));
  KILN_TRY(BakeSettings settings,
           read_written_settings({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  settings.unwrap_cache = a.get("unwrap-cache");
  std::vector<StageTime> times;
  KILN_TRY(const Preflight pre, run_preflight(a.get("scene"), settings, times, [](const BakeProgress&) {}));
  ChunkStore chunks;
  return make_job(pre, settings, chunks).map([](const JobSpec&) {});
}

int run(const Arguments& a, const BakeSettings&) {
  die_with_parent();
  const Status checked = check(a);
  std::_Exit(checked ? 0 : report_error(checked.error()));  // nothing of it is needed: no time for freeing
}

}  // namespace

Command check_scene_command() {
  Command command{kCheckVerb,
                  "Import a scene and lay out its lightmap under a limit of memory",
                  "kiln check-scene scene.glb --settings job.json --unwrap-cache off --memory-mib 4096",
                  {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true},
                   {"--settings", "FILE", "a job's settings, as written by the coordinator", true},
                   {"--unwrap-cache", "DIR", "the coordinator's", true},
                   {"--memory-mib", "N", "most memory that it may take", true}},
                  false,
                  run};
  command.hidden = true;
  return command;
}

}  // namespace kiln

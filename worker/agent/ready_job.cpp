#include "worker/agent/ready_job.h"

#include <algorithm>
#include <exception>
#include <fstream>
#include <new>

#include "common/base/parallel.h"
#include "common/scene/prepared.h"

namespace kiln {
namespace {

// The lowest limit from our group up to the root; "max" and a missing file mean no limit.
uint64_t group_limit(const std::string& root, std::string group, const std::string& file) {
  uint64_t least = ~uint64_t{0};
  for (;;) {
    uint64_t limit = 0;
    if (std::ifstream in(root + group + "/" + file); in >> limit) least = std::min(least, limit);
    if (group.find_last_not_of("/") == std::string::npos || group.front() != '/') return least;
    group.resize(group.rfind('/'));
  }
}

}  // namespace

JobChunks chunks_of(const ChunkCache& cache, const JobFetch& fetch) {
  JobChunks chunks;
  for (const Digest& id : fetch.needed()) chunks.emplace(id, cache.find(id));
  return chunks;
}

Expected<std::shared_ptr<const Baker>> make_ready_baker(const JobSpec& job, const JobChunks& chunks,
                                                        const AgentSettings& settings) {
  const auto find = [&](const Digest& id) -> const Bytes* {
    const auto it = chunks.find(id);
    return it == chunks.end() ? nullptr : it->second.get();
  };
  try {
    KILN_TRY(Scene scene, read_scene(*find(job.scene), find));
    KILN_TRY(Atlas atlas, read_atlas(*find(job.atlas), scene));
    KILN_TRY(auto baker,
             settings.make_baker(std::move(scene), std::move(atlas), job.transport, settings.threads));
    return std::shared_ptr<const Baker>(std::move(baker));
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::kNoSpace, "not enough memory for the scene on this machine");
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInternal, e.what());
  }
}

uint64_t ready_bytes(uint64_t chunk_bytes) {
  return 4 * chunk_bytes;
}

uint64_t default_memory_budget() {
  uint64_t bytes = memory_bytes();
  std::ifstream in("/proc/self/cgroup");  // lines "number:controllers:/group"
  for (std::string line; std::getline(in, line);) {
    const size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1),
                      group = line.substr(second + 1);
    if (controllers.empty()) bytes = std::min(bytes, group_limit("/sys/fs/cgroup", group, "memory.max"));
    if (controllers == "memory")
      bytes = std::min(bytes, group_limit("/sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
  }
  return bytes / 2;
}

}  // namespace kiln

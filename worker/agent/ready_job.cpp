#include "worker/agent/ready_job.h"

#include <exception>
#include <new>

#include "common/base/parallel.h"
#include "common/scene/prepared.h"

namespace kiln {
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
    std::unique_ptr<Baker> baker;
    if (job.transport.quantities.probes) {
      KILN_TRY(ProbePoints probes, read_probe_points(*find(job.atlas)));
      if (!settings.make_probe_baker) return fail(ErrorKind::kUnavailable, "this worker bakes no probes");
      KILN_TRY(baker, settings.make_probe_baker(std::move(scene), std::move(probes), job.transport,
                                                settings.threads));
    } else {
      KILN_TRY(Atlas atlas, read_atlas(*find(job.atlas), scene));
      KILN_TRY(baker,
               settings.make_baker(std::move(scene), std::move(atlas), job.transport, settings.threads));
    }
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
  return memory_bytes() / 2;
}

}  // namespace kiln

// Builds a baker from a job's chunks; estimates a job's memory.
#pragma once

#include <map>
#include <memory>

#include "worker/agent/agent.h"
#include "worker/agent/job_fetch.h"

namespace kiln {

// The chunks of one job, held for the thread that prepares it.
using JobChunks = std::map<Digest, ChunkBytes>;
JobChunks chunks_of(const ChunkCache& cache, const JobFetch& fetch);

// Reads scene and atlas and builds the baker. Out of memory is an error (kNoSpace).
Expected<std::shared_ptr<const Baker>> make_ready_baker(const JobSpec& job, const JobChunks& chunks,
                                                        const AgentSettings& settings);

// Estimated memory of a ready job: decoded scene, acceleration structure, light and texel tables.
uint64_t ready_bytes(uint64_t chunk_bytes);

// Half of the memory that this process may use.
uint64_t default_memory_budget();

}  // namespace kiln

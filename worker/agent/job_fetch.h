// Determines a job's missing chunks: the structure and the atlas first, then the chunks that the structure
// names.
#pragma once

#include <unordered_set>

#include "common/job/unit.h"
#include "worker/agent/chunk_cache.h"

namespace kiln {

class JobFetch {
 public:
  JobFetch(const JobSpec& job, const ChunkCache& cache) : job_(job), cache_(cache) {}

  // Ids of chunks to get next, at most kMaxIdsPerRequest and each once; empty when everything is here.
  // Recomputed on each call, so that chunks received before a lost connection are not fetched again. Fails
  // (kInvalidInput) on an unreadable structure.
  Expected<std::vector<Digest>> missing();
  const std::unordered_set<Digest>& needed() const { return needed_; }  // all, once nothing is missing
  uint64_t total_bytes() const;                                         // of those in the cache

 private:
  JobSpec job_;
  const ChunkCache& cache_;
  bool structure_read_ = false;
  std::vector<Digest> named_;
  std::unordered_set<Digest> needed_;
};

}  // namespace kiln

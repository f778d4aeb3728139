#include "worker/agent/job_fetch.h"

#include "common/scene/prepared.h"
#include "common/wire/limits.h"

namespace kiln {

Expected<std::vector<Digest>> JobFetch::missing() {
  std::vector<Digest> ids;
  for (const Digest& id : {job_.scene, job_.atlas})
    if (needed_.insert(id); !cache_.find(id)) ids.push_back(id);
  if (!ids.empty()) return ids;
  if (!structure_read_) {
    KILN_TRY(named_, scene_chunks(*cache_.find(job_.scene)));
    needed_.insert(named_.begin(), named_.end());
    structure_read_ = true;
  }
  std::unordered_set<Digest> seen;
  for (const Digest& id : named_) {
    if (ids.size() == kMaxIdsPerRequest) break;
    if (!cache_.find(id) && seen.insert(id).second) ids.push_back(id);
  }
  return ids;
}

uint64_t JobFetch::total_bytes() const {
  uint64_t total = 0;
  for (const Digest& id : needed_)
    if (const ChunkBytes bytes = cache_.find(id)) total += bytes->size();
  return total;
}

}  // namespace kiln

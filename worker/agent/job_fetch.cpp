#include "worker/agent/job_fetch.h"

#include <algorithm>

#include "common/scene/prepared.h"
#include "common/wire/limits.h"

namespace kiln {

Expected<std::vector<Digest>> JobFetch::next() {
  if (!asked_.empty()) return std::vector<Digest>{};
  std::vector<Digest> first;
  for (const Digest& id : {job_.scene, job_.atlas})
    if (!cache_.find(id)) first.push_back(id);
  if (first.empty()) {
    if (!structure_read_) {
      KILN_TRY(named_, scene_chunks(*cache_.find(job_.scene)));
      structure_read_ = true;
    }
    // Anew each time: what came before a connection was lost need not come again.
    missing_.clear();
    std::unordered_set<Digest> seen;
    for (const Digest& id : named_)
      if (!cache_.find(id) && seen.insert(id).second) missing_.push_back(id);
    first.assign(missing_.begin(),
                 missing_.begin() + std::min<ptrdiff_t>(std::ssize(missing_), kMaxIdsPerRequest));
    missing_.erase(missing_.begin(), missing_.begin() + std::ssize(first));
  }
  asked_.insert(first.begin(), first.end());
  return first;
}

bool JobFetch::complete() const {
  const auto here = [this](const Digest& id) { return cache_.find(id) != nullptr; };
  return asked_.empty() && structure_read_ && here(job_.atlas) &&
         std::all_of(named_.begin(), named_.end(), here);
}

std::unordered_set<Digest> JobFetch::needed() const {
  std::unordered_set<Digest> ids(named_.begin(), named_.end());
  ids.insert(job_.scene);
  ids.insert(job_.atlas);
  return ids;
}

}  // namespace kiln

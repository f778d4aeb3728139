// What a job still lacks: the structure and the atlas first, then the chunks that the structure names.
#pragma once

#include <optional>
#include <unordered_set>

#include "common/job/unit.h"
#include "worker/agent/chunk_cache.h"

namespace kiln {

class JobFetch {
 public:
  JobFetch(const JobSpec& job, const ChunkCache& cache) : job_(job), cache_(cache) {}

  // Ids to ask for next (at most kMaxIdsPerRequest); empty while some that were asked for are on their
  // way, and when everything is here.
  Expected<std::vector<Digest>> next();
  void arrived(const Digest& id) { asked_.erase(id); }
  bool expects(const Digest& id) const { return asked_.count(id) > 0; }
  void connection_lost() { asked_.clear(); }
  bool complete() const;
  std::unordered_set<Digest> needed() const;

 private:
  JobSpec job_;
  const ChunkCache& cache_;
  bool structure_read_ = false;
  std::vector<Digest> missing_;  // not here and not asked for
  std::vector<Digest> named_;
  std::unordered_set<Digest> asked_;
};

}  // namespace kiln

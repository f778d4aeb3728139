// The irradiance caches of one job that are in memory: those that units here name, and of the others the ones
// used last, as many as there are replicates, because units of the same pass will name them again.
#pragma once

#include <memory>
#include <unordered_map>
#include <unordered_set>

#include "worker/agent/shared_cache.h"

namespace kiln {

class CacheShelf {
 public:
  std::shared_ptr<const SharedCache> find(const Digest& id);  // null: not here; else it is the one used last
  void put(const Digest& id, std::shared_ptr<const SharedCache> cache, uint64_t bytes);
  // `named`: by units that are here. Tasks that run keep what they use.
  void drop_old(const std::unordered_set<Digest>& named);
  void clear() { held_.clear(); }
  uint64_t bytes() const;

 private:
  struct Held {
    std::shared_ptr<const SharedCache> cache;
    uint64_t bytes = 0, last_use = 0;
  };
  std::unordered_map<Digest, Held> held_;
  uint64_t uses_ = 0;
};

}  // namespace kiln

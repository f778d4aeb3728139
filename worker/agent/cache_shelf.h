// One job's irradiance caches in memory: those named by units held here, plus the most recently used others,
// one per replicate, because units of the same pass will name them again.
#pragma once

#include <memory>
#include <unordered_map>
#include <unordered_set>

#include "worker/agent/shared_cache.h"

namespace kiln {

class CacheShelf {
 public:
  std::shared_ptr<const SharedCache> find(
      const Digest& id);  // null: not here; marks it as most recently used
  void put(const Digest& id, std::shared_ptr<const SharedCache> cache, uint64_t bytes);
  // `named`: by units held here. Running tasks keep their own reference.
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

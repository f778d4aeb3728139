#include "worker/agent/cache_shelf.h"

#include <algorithm>
#include <vector>

#include "common/job/unit.h"

namespace kiln {

std::shared_ptr<const SharedCache> CacheShelf::find(const Digest& id) {
  const auto it = held_.find(id);
  if (it == held_.end()) return nullptr;
  it->second.last_use = ++uses_;
  return it->second.cache;
}

void CacheShelf::put(const Digest& id, std::shared_ptr<const SharedCache> cache, uint64_t bytes) {
  held_[id] = {std::move(cache), bytes, ++uses_};
}

void CacheShelf::drop_old(const std::unordered_set<Digest>& named) {
  std::vector<uint64_t> uses;
  for (const auto& [id, held] : held_) uses.push_back(held.last_use);
  if (uses.size() <= kReplicates) return;
  std::nth_element(uses.begin(), uses.end() - kReplicates, uses.end());
  const uint64_t least = *(uses.end() - kReplicates);
  std::erase_if(
      held_, [&](const auto& entry) { return entry.second.last_use < least && !named.count(entry.first); });
}

uint64_t CacheShelf::bytes() const {
  uint64_t total = 0;
  for (const auto& [id, held] : held_) total += held.bytes;
  return total;
}

}  // namespace kiln

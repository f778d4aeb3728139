// Units that name an irradiance cache wait here until it is loaded: from memory, then disk, then the
// coordinator.
#include "worker/agent/agent_impl.h"

namespace kiln {

// Starts waiting units whose cache is here, and requests caches not yet on their way.
void Agent::feed_waiting() {
  std::deque<Unit> still;
  std::vector<Digest> lacking;
  for (Unit& unit : waiting_) {
    KnownJob& job = jobs_.at(unit.job);
    const Digest& id = unit.unit.cache;
    auto cache = job.caches.find(id);
    if (!cache) cache = shelve(job, id);
    if (cache) {
      begin(job, std::move(unit), std::move(cache));
      continue;
    }
    if (awaited_caches_.insert(id).second) lacking.push_back(id);
    still.push_back(std::move(unit));
  }
  waiting_ = std::move(still);
  if (lacking.empty()) return;
  if (!environment_.has_disk()) return request(lacking);
  environment_.look_up(lacking, [this, connection = connection_count_, lacking](const auto& found) {
    on_caches_looked_up(connection, lacking, found);
  });
}

// Removes the chunk from the chunk cache, where it would remain as a second copy.
std::shared_ptr<const SharedCache> Agent::shelve(KnownJob& job, const Digest& id) {
  const ChunkBytes bytes = cache_.take(id);
  if (!bytes) return nullptr;
  const uint64_t size = bytes->size();
  make_room(size);  // use it even if it does not fit: the budget is an estimate
  auto cache = std::make_shared<const SharedCache>(id, bytes, job.baker->sites());
  job.caches.put(id, cache, size);
  std::unordered_set<Digest> named;
  for (const auto& [key, taken] : taken_)
    if (key.first == job.spec.id) named.insert(taken.unit.cache);
  job.caches.drop_old(named);
  // Others arrive for units withdrawn meanwhile.
  std::unordered_set<Digest> needed = job.chunks;
  if (const KnownJob* now = current()) needed.insert(now->fetch.needed().begin(), now->fetch.needed().end());
  cache_.shrink(needed, settings_.memory_bytes / 4);
  return cache;
}

void Agent::on_caches_looked_up(uint64_t connection, const std::vector<Digest>& ids,
                                const std::vector<ChunkBytes>& found) {
  if (connection != connection_count_) return;  // the waiting units were dropped with the connection
  std::vector<Digest> absent;
  for (size_t i = 0; i < ids.size(); ++i) {
    if (!awaited_caches_.count(ids[i])) continue;  // nobody waits any more
    if (found[i])
      cache_.put(ids[i], found[i]), awaited_caches_.erase(ids[i]);
    else
      absent.push_back(ids[i]);
  }
  if (!absent.empty()) request(absent);
  feed_waiting();
}

// Stop awaiting a cache that no unit needs: the coordinator may have dropped it before the request, and a
// later unit requests it again.
void Agent::stop_waiting(const std::function<bool(const Unit&)>& wanted) {
  std::erase_if(waiting_, wanted);
  std::unordered_set<Digest> named;
  for (const Unit& unit : waiting_) named.insert(unit.unit.cache);
  std::erase_if(awaited_caches_, [&](const Digest& id) { return !named.count(id); });
}

}  // namespace kiln

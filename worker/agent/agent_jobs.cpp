#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "worker/agent/agent_impl.h"

namespace kiln {

Agent::KnownJob* Agent::known(uint64_t job) {
  const auto it = jobs_.find(job);
  return it == jobs_.end() ? nullptr : &it->second;
}

Agent::KnownJob* Agent::current() {
  return current_ ? known(*current_) : nullptr;
}

void Agent::start_job(const Job& message) {
  const uint64_t id = message.spec.id;
  const KnownJob* same = known(id);
  if (same && write_job(same->spec) != write_job(message.spec))
    end_job(id, "another job of this number was given");
  current_ = id;
  forget_unready();
  KnownJob& job = jobs_.try_emplace(id, message.spec, cache_).first->second;
  job.last_use = ++uses_;
  const std::string& isa = job.spec.transport.isa;
  // The class and the chunks do not wait for each other.
  if (const auto it = classes_.find(isa); it != classes_.end())
    on_class(id, isa, it->second);
  else
    classify(id, isa);
  fetch();
}

// Abandons jobs still loading when another one arrives. Keeps their results.
void Agent::forget_unready() {
  std::erase_if(jobs_, [&](const auto& entry) {
    return !entry.second.baker && entry.second.kept.empty() && current_ != entry.first &&
           preparing_ != entry.first;
  });
}

void Agent::end_job(uint64_t id, const std::string& reason) {
  KnownJob* job = known(id);
  if (!job) return;
  log_info(text("job {} is over: {}", id, reason));
  drop_taken(id, [](uint64_t) { return true; });
  while (!job->kept.empty()) drop_kept(*job, job->kept.begin()->first);
  if (current_ == id) current_.reset();
  jobs_.erase(id);
  leave_if_drained();
  settle_credits();
}

void Agent::classify(uint64_t id, const std::string& isa) {
  environment_.classify(isa,
                        [this, id, isa](Expected<std::string> name) { on_class(id, isa, std::move(name)); });
}

void Agent::on_class(uint64_t id, const std::string& isa, Expected<std::string> name) {
  if (name) classes_[isa] = *name;
  KnownJob* job = known(id);
  if (!job) return;
  if (!name) return fail_job(id, name.error());
  job->numeric_class = *name;
  tell_class(*job);
  if (current_ == id && job->baker) offer();
}

// The worker stays for other jobs.
void Agent::fail_job(uint64_t id, const Error& error) {
  log_error(text("cannot bake job {}: {}", id, error.message));
  send(JobFailed{id, error.kind, error.message});
  if (current_ == id) current_.reset();
  if (KnownJob* job = known(id); job && job->kept.empty()) jobs_.erase(id);
}

// Gets the current job's missing chunks: from memory, then disk, then the coordinator.
void Agent::fetch() {
  KnownJob* job = current();
  if (!welcomed_ || draining_ || !job || job->baker || preparing_ || !job->awaited.empty()) return;
  const auto ids = job->fetch.missing();
  if (!ids) return fail_job(job->spec.id, ids.error());
  if (ids->empty()) return prepare();
  job->awaited.insert(ids->begin(), ids->end());
  if (!environment_.has_disk()) return request(*ids);
  environment_.look_up(*ids, [this, id = job->spec.id, connection = connection_count_,
                              ids = *ids](const auto& found) { on_looked_up(id, connection, ids, found); });
}

void Agent::on_looked_up(uint64_t id, uint64_t connection, const std::vector<Digest>& ids,
                         const std::vector<ChunkBytes>& found) {
  for (size_t i = 0; i < ids.size(); ++i)
    if (found[i]) cache_.put(ids[i], found[i]);
  KnownJob* job = known(id);
  if (!job || connection != connection_count_) return fetch();
  std::vector<Digest> absent;
  for (size_t i = 0; i < ids.size(); ++i)
    if (found[i])
      job->awaited.erase(ids[i]);
    else if (job->awaited.count(ids[i]))
      absent.push_back(ids[i]);
  if (current_ == id && !absent.empty()) request(absent);
  fetch();
}

// Chunks requested for an abandoned job may be on their way, or the coordinator dropped the request: request
// again.
void Agent::request(const std::vector<Digest>& ids) {
  asked_.insert(ids.begin(), ids.end());
  // On loopback the network is faster than zstd.
  send(ChunkRequest{ids, !connection_->loopback()});
}

void Agent::on_piece(const ChunkPiece& piece) {
  if (!asked_.count(piece.id)) return break_connection("a chunk that was not requested");
  const auto chunk = cache_.add(piece);
  if (!chunk) return break_connection(chunk.error().message);
  if (!*chunk) return;
  environment_.store(piece.id, *chunk);
  for (auto& [id, job] : jobs_) job.awaited.erase(piece.id);
  awaited_caches_.erase(piece.id);
  feed_waiting();
  fetch();
}

// Evicts the least recently used ready jobs; a job with running units cannot be evicted.
bool Agent::make_room(uint64_t bytes) {
  const uint64_t budget = settings_.memory_bytes / 4 * 3;
  for (;;) {
    uint64_t used = 0;
    bool busy = false;
    std::map<uint64_t, KnownJob>::iterator oldest = jobs_.end();
    for (auto it = jobs_.begin(); it != jobs_.end(); ++it) {
      if (!it->second.baker) continue;
      used += it->second.bytes + it->second.caches.bytes();
      const auto first = taken_.lower_bound({it->first, 0});
      const bool in_use = first != taken_.end() && first->first.first == it->first;
      busy = busy || in_use;
      if (!in_use && (oldest == jobs_.end() || it->second.last_use < oldest->second.last_use)) oldest = it;
    }
    if (used + bytes <= budget) return true;
    if (oldest == jobs_.end()) return !busy;  // alone it may still fit: the factor is an estimate
    log_info(text("the scene of job {} leaves memory", oldest->first));
    oldest->second.baker.reset();
    oldest->second.caches.clear();
    forget_unready();
  }
}

void Agent::prepare() {
  KnownJob& job = *current();
  job.chunks = job.fetch.needed();
  job.bytes = ready_bytes(job.fetch.total_bytes());
  if (!make_room(job.bytes)) return;  // on_done calls again
  cache_.shrink(job.chunks, settings_.memory_bytes / 4);
  preparing_ = job.spec.id;
  log_info(
      text("making the scene of job {} ready: {} MiB of chunks", job.spec.id, job.fetch.total_bytes() >> 20));
  environment_.prepare(job.spec, chunks_of(cache_, job.fetch),
                       [this, id = job.spec.id](const auto& baker) { on_prepared(id, baker); });
}

void Agent::on_prepared(uint64_t id, Expected<std::shared_ptr<const Baker>> baker) {
  preparing_.reset();
  if (KnownJob* job = known(id)) {
    if (!baker) {
      fail_job(id, baker.error());
    } else {
      for (const std::string& warning : (*baker)->warnings()) log_warning(warning);
      job->baker = *baker;
      if (current_ == id && !job->numeric_class.empty()) offer();
    }
  }
  fetch();
}

}  // namespace kiln

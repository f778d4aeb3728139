// Chooses the unit that a worker gets next, and the job that it serves: by the user's turn, then priority,
// then age.
#include <algorithm>

#include "common/base/check.h"
#include "coordinator/farm/ledger/grants.h"

namespace kiln {
namespace {

constexpr int64_t kSpeedMs = 20;
constexpr size_t kManyWorkers = 256;  // above this, full searches are limited to this rate
constexpr int64_t kPauseMs = 10;
constexpr uint32_t kSearches =
    64;  // fruitless searches of a job in that time: more than have answered any one unit

}  // namespace

bool Grants::holds_suspect(const Worker& worker) const {
  if (!units_.at(worker.job).suspected) return false;
  return std::any_of(worker.leases.all().begin(), worker.leases.all().end(),
                     [&](uint64_t lease) { return at(lease).unit->suspect(); });
}

// A suspect that this identity has not failed; one that every able worker has failed may go to any.
UnitTable::Ref Grants::choose_suspect(const Worker& worker, JobId job_id) const {
  for (const uint64_t id : units_.at(job_id).suspects) {
    const UnitTable::Ref unit = units_.find(job_id, id);
    const auto failed = [&](const Worker& w) {
      return std::any_of(unit->blamed.begin(), unit->blamed.end(),
                         [&](const UnitTable::Blame& b) { return b.who == w.identity; });
    };
    if (!failed(worker)) return unit;
    const bool all_failed = std::all_of(workers_.all().begin(), workers_.all().end(), [&](const auto& entry) {
      return entry.second.presence != WorkerTable::Presence::kActive || failed(entry.second) ||
             entry.second.banned.count(worker.job);
    });
    if (all_failed) return unit;
  }
  return {};
}

UnitTable::Ref Grants::choose_second(const Worker& worker, JobId job_id) const {
  const auto leased = [&](const Unit& unit) {
    return std::any_of(unit.leases.all().begin(), unit.leases.all().end(), [&](uint64_t lease) {
      return trust_.same_voter(at(lease).worker->identity, worker.identity);
    });
  };
  for (const uint64_t id : units_.at(job_id).seconds) {
    const UnitTable::Ref unit = units_.find(job_id, id);
    if (!units_.voted(*unit, worker.identity) && !leased(*unit)) return unit;
  }
  return {};
}

// The newest unit not yet started by the worker with the longest queue.
Grants::Steal Grants::choose_steal(WorkerId id, const Worker& worker) const {
  const Book& book = this->book(worker.job);
  for (auto it = book.backlogs.rbegin(); it != book.backlogs.rend(); ++it) {
    KILN_CHECK(it->second != id);  // it has a thread without a unit
    const Worker* other = workers_.find(it->second);
    KILN_CHECK(other && !other->leases.empty());
    const UnitTable::Ref& newest = at(*other->leases.all().rbegin()).unit;
    if (newest->leases.size() > 1 || newest->suspect() || units_.voted(*newest, worker.identity)) continue;
    return {newest, it->second};
  }
  return {};
}

// The oldest lease that has taken twice the usual time for its work, of a unit with no other holder; once per
// unit and at most a share of the pass (Dean & Barroso, "The Tail at Scale", 2013: hedged requests).
UnitTable::Ref Grants::choose_copy(WorkerId id, JobId job_id, int64_t now) const {
  const Book& book = this->book(job_id);
  if (book.leases.empty()) return {};
  const Job& job = units_.at(job_id);
  const Worker* worker = id ? workers_.find(id) : nullptr;
  const double per_weight = book.turnaround_weight > 0 ? book.turnaround_ms / book.turnaround_weight : 0;
  for (const uint64_t number : book.leases) {
    const Lease& lease = at(number);
    const Unit& unit = *lease.unit;
    const double usual = per_weight > 0 ? per_weight * unit.weight : static_cast<double>(rules_.lease_ms) / 2;
    const double age = static_cast<double>(now - lease.since);
    if (age <= 2 * usual) continue;
    const bool within_share = book.copied_weight + unit.weight <=
                              std::max(rules_.speculative_share * job.counts.weight, unit.weight);
    if (!within_share && age <= 10 * usual) continue;
    const bool mine = lease.worker.id() == id || (worker && units_.voted(unit, worker->identity));
    if (mine || unit.copied || unit.suspect() || unit.leases.size() > 1) continue;
    return lease.unit;
  }
  return {};
}

void Grants::note_copy(const UnitTable::Ref& unit) {
  books_.at(unit.job_id()).copied_weight += unit->weight;
}

bool Grants::may_search(JobId job, int64_t now) {
  Book& book = books_.at(job);
  if (now - book.searched_at >= kPauseMs) book.searched_at = now, book.searches = 0;
  return workers_.all().size() <= kManyWorkers || book.searches < kSearches;
}

// Speed of all its workers together and of the fastest. Cached briefly, because every grant needs it and
// rates average many results.
void Grants::reckon_speed(JobId id, const Book& book, int64_t now) const {
  book.speed = {now, 0, 0};
  for (const auto& [worker_id, worker] : workers_.all()) {
    const double rate = worker.leases.rate();
    if (worker.job != id || !worker.ready || worker.presence != WorkerTable::Presence::kActive || rate <= 0)
      continue;
    const double ms = worker.traits.threads / rate;
    if (book.speed.rate <= 0 || ms < book.speed.least_ms) book.speed.least_ms = ms;
    book.speed.rate += rate;
  }
}

// A machine ten times slower would make all others wait for its last unit: it gets none that the others would
// finish sooner.
bool Grants::would_end_late(const Worker& worker, double weight, int64_t now) const {
  const double rate = worker.leases.rate();
  if (rate <= 0) return false;
  const Book& book = this->book(worker.job);
  if (book.speed.when < 0 || now - book.speed.when >= kSpeedMs) reckon_speed(worker.job, book, now);
  if (book.speed.rate <= 0) return false;
  const PassCounts& counts = units_.at(worker.job).counts;
  const double best = 2 * weight * book.speed.least_ms;  // one running, one waiting
  const double rest = (counts.weight - counts.weight_done) / book.speed.rate;
  const double mine = std::max(weight * worker.traits.threads, worker.leases.weight() + weight) / rate;
  return mine > 1.3 * std::max(rest, best);
}

double Grants::usual_ms(JobId job, double weight) const {
  const Book& book = this->book(job);
  return book.turnaround_weight > 0 ? book.turnaround_ms / book.turnaround_weight * weight : 0;
}

// Whether there is a unit for the worker now.
bool Grants::has_work(JobId id, const Job& job, const Worker& worker) const {
  if (!job.open) return false;
  return !job.pending.empty() || book(id).spare || choose_suspect(worker, id) || choose_second(worker, id);
}

// Virtual time of the job's user after one residence of all workers that would serve it; the smallest is
// next.
double Grants::turn(const Job& job, double more_threads) const {
  const FairShare& share = workers_.share();
  const double threads = share.threads(job.user) + more_threads;
  return share.virtual_time(job.user) + threads * static_cast<double>(rules_.residence_ms) / job.weight;
}

JobId Grants::pick_job(const Worker& worker) const {
  JobId best = 0;
  double best_turn = 0;
  const Job* best_job = nullptr;
  for (const auto& [id, job] : units_.jobs()) {
    if (!WorkerTable::may_work(id, job, worker) || !has_work(id, job, worker)) continue;
    const bool same_user = best_job && job.user == best_job->user;
    const double its_turn = turn(job, worker.counted_for == job.user ? 0 : worker.traits.threads);
    const bool better =
        !best_job || (same_user ? job.traits.priority > best_job->traits.priority : its_turn < best_turn);
    if (!better) continue;
    best = id;
    best_turn = its_turn;
    best_job = &job;
  }
  return best;
}

void Grants::find_spare(int64_t now) {
  for (const auto& [id, job] : units_.jobs()) {
    Book& book = books_.at(id);
    book.spare = job.open && (!book.backlogs.empty() || choose_copy(0, id, now));
  }
}

}  // namespace kiln

#include "coordinator/farm/ledger/grants.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr double kRateMemory = 0.2;  // weight of the newest result in a worker's rate

}  // namespace

uint64_t Grants::add(const UnitTable::Ref& unit, const WorkerTable::Ref& worker, int64_t now) {
  WorkerLeases& held = worker.leases();
  KILN_CHECK(unit.job_id() == worker->job && held.size() < worker->credits);
  KILN_CHECK(unit->phase == UnitTable::Phase::kOpen && find(worker.id(), *unit) == 0);
  if (held.empty()) held.busy_since_ = now;
  const uint64_t lease = next_lease_++;
  leases_.emplace(lease, Lease{worker, unit, unit->weight, now});
  Book& book = books_.at(unit.job_id());
  held.all_.insert(lease);
  note_backlog(book, worker, held.size() - 1);
  held.weight_ += unit->weight;
  unit.leases().all_.push_back(lease);
  book.leases.insert(lease);
  return lease;
}

void Grants::release(uint64_t number) {
  const auto it = leases_.find(number);
  if (it == leases_.end()) return;
  const Lease& lease = it->second;
  Book& book = books_.at(lease.unit.job_id());
  WorkerLeases& held = lease.worker.leases();
  const size_t before = held.size();
  KILN_CHECK(held.all_.erase(number) == 1);
  note_backlog(book, lease.worker, before);
  held.weight_ = held.empty() ? 0 : held.weight_ - lease.weight;
  KILN_CHECK(std::erase(lease.unit.leases().all_, number) == 1);
  KILN_CHECK(book.leases.erase(number) == 1);
  leases_.erase(it);
}

void Grants::release_of(const UnitTable::Ref& unit) {
  while (!unit->leases.empty()) release(unit->leases.all().front());
}

void Grants::recall_of(const UnitTable::Ref& unit, Actions& out) {
  for (const uint64_t lease : unit->leases.all())
    out.push_back(Recall{at(lease).worker.id(), unit.job_id(), unit.id()});
  release_of(unit);
}

void Grants::release_all(JobId job) {
  const std::set<uint64_t> leases = book(job).leases;
  for (const uint64_t lease : leases) release(lease);
  KILN_CHECK(book(job).leases.empty());
}

void Grants::recall_all(JobId job, Actions& out) {
  for (const uint64_t lease : book(job).leases)
    out.push_back(Recall{at(lease).worker.id(), job, at(lease).unit.id()});
  release_all(job);
}

const Grants::Lease& Grants::at(uint64_t lease) const {
  const auto it = leases_.find(lease);
  KILN_CHECK(it != leases_.end());
  return it->second;
}

// The lease that a message names does not matter: a claim after a reconnect creates a new one.
uint64_t Grants::find(WorkerId worker, const Unit& unit) const {
  for (const uint64_t lease : unit.leases.all())
    if (at(lease).worker.id() == worker) return lease;
  return 0;
}

void Grants::answered(uint64_t number, int64_t now) {
  const Lease lease = at(number);
  Book& book = books_.at(lease.unit.job_id());
  WorkerLeases& held = lease.worker.leases();
  book.turnaround_ms += static_cast<double>(now - lease.since);
  book.turnaround_weight += lease.weight;
  const double ms = std::max(1.0, static_cast<double>(now - std::max(lease.since, held.busy_since_)));
  const double rate = lease.weight / ms;  // over all its threads, whose results interleave
  held.rate_ = held.rate_ > 0 ? held.rate_ + kRateMemory * (rate - held.rate_) : rate;
  held.busy_since_ = now;
}

void Grants::answered_without_lease(const WorkerTable::Ref& worker) {
  WorkerLeases& held = worker.leases();
  if (held.ghosts_ > 0) --held.ghosts_;
}

void Grants::haunt(const WorkerTable::Ref& worker) {
  worker.leases().ghosts_ += worker->leases.size();
}

void Grants::end_job(JobId job) {
  KILN_CHECK(book(job).leases.empty());
  books_.erase(job);
}

void Grants::begin_pass(JobId job) {
  Book& book = books_.at(job);
  book.copied_weight = book.turnaround_ms = book.turnaround_weight = 0;
}

const Grants::Book& Grants::book(JobId job) const {
  const auto it = books_.find(job);
  KILN_CHECK(it != books_.end());
  return it->second;
}

void Grants::note_backlog(Book& book, const WorkerTable::Ref& worker, size_t held_before) {
  const size_t threads = worker->traits.threads, now = worker->leases.size();
  if (held_before > threads) book.backlogs.erase({held_before - threads, worker.id()});
  if (now > threads) book.backlogs.insert({now - threads, worker.id()});
}

std::string Grants::audit() const {
  size_t of_units = 0, of_workers = 0, of_jobs = 0;
  for (const auto& [number, lease] : leases_) {
    const auto& with_unit = lease.unit->leases.all();
    if (std::count(with_unit.begin(), with_unit.end(), number) != 1 ||
        !lease.worker->leases.all().count(number) || !book(lease.unit.job_id()).leases.count(number))
      return text("lease {} of unit {} does not stand with its unit, its worker and its job", number,
                  lease.unit.id());
    if (lease.worker->job != lease.unit.job_id())
      return text("worker {} holds a unit of job {} and serves job {}", lease.worker.id(),
                  lease.unit.job_id(), lease.worker->job);
    if (find(lease.worker.id(), *lease.unit) != number)
      return text("worker {} holds unit {} twice", lease.worker.id(), lease.unit.id());
  }
  for (const auto& [id, job] : units_.jobs()) {
    const Book& book = this->book(id);
    of_jobs += book.leases.size();
    for (const auto& [unit_id, unit] : job.units) of_units += unit.leases.size();
    std::set<std::pair<size_t, WorkerId>> backlogs;
    for (const auto& [worker_id, worker] : workers_.all())
      if (worker.job == id && worker.leases.size() > worker.traits.threads)
        backlogs.insert({worker.leases.size() - worker.traits.threads, worker_id});
    if (backlogs != book.backlogs)
      return text("the backlogs of job {} differ from what its workers hold", id);
  }
  for (const auto& [id, worker] : workers_.all()) {
    of_workers += worker.leases.size();
    if (worker.leases.size() > std::max<size_t>(worker.credits, 1))
      return text("worker {} holds more than its credits", id);
  }
  if (of_units != leases_.size() || of_workers != leases_.size() || of_jobs != leases_.size())
    return text("{} leases exist, units have {}, workers {}, jobs {}", leases_.size(), of_units, of_workers,
                of_jobs);
  if (books_.size() != units_.jobs().size())
    return text("{} jobs have leases booked, {} exist", books_.size(), units_.jobs().size());
  return {};
}

}  // namespace kiln

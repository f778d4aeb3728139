// Workers, their links, the disk, and what befalls them.
#include <algorithm>

#include "common/base/format.h"
#include "tests/sim/world.h"

namespace kiln::sim {
namespace {

constexpr int kMostLosses = 2;  // of a sound unit: one fewer than FarmRules::max_attempts

}  // namespace

// One flush at a time takes all that waits: group commit. What follows a write runs only once it is on disk.
void World::write(std::function<void(Disk&)> change, std::function<void()> then) {
  unflushed_.push_back({std::move(change), std::move(then)});
  if (!flushing_) flush();
}

void World::flush() {
  flushing_ = true;
  at(now_ + 1 + static_cast<int64_t>(draw(4)), [this, epoch = epoch_, count = unflushed_.size()] {
    if (!up_ || epoch != epoch_) return;
    Actions out;
    if (full_) {
      ++figures_.refused_writes;
      ledger_->hold(true, clock(), out);
      perform(out);
      at(now_ + 50, [this, epoch] {
        if (up_ && epoch == epoch_) flush();
      });
      return;
    }
    ledger_->hold(false, clock(), out);
    std::vector<Write> batch(std::make_move_iterator(unflushed_.begin()),
                             std::make_move_iterator(unflushed_.begin() + static_cast<ptrdiff_t>(count)));
    unflushed_.erase(unflushed_.begin(), unflushed_.begin() + static_cast<ptrdiff_t>(count));
    for (Write& w : batch) w.change(disk_);
    flushing_ = false;
    if (!unflushed_.empty()) flush();
    perform(out);
    for (Write& w : batch)
      if (w.then && up_ && epoch == epoch_) w.then();
  });
}

void World::connect(size_t i) {
  Machine& m = machines_[i];
  if (!m.alive || m.link || !up_) return;
  const uint64_t link = m.link = next_link_++;
  for (Kept& kept : m.kept) kept.sent = false;
  const WorkerId worker = next_worker_++;
  worker_of_[link] = worker;
  at(now_ + 1 + static_cast<int64_t>(draw(20)), [this, i, link, worker, epoch = epoch_] {
    if (!up_ || epoch != epoch_ || machines_[i].link != link) return;
    Actions out;
    // A connection of the same process that nobody has seen break yet ends in good order (Server::admit).
    for (auto it = machine_of_.begin(); it != machine_of_.end();) {
      const WorkerId older = it->first;
      const bool same = it->second == i && process_of_[older] == machines_[i].process;
      it = same ? machine_of_.erase(it) : std::next(it);
      if (!same) continue;
      heard_at_.erase(older);
      granted_.erase(older);
      ledger_->leave(older, false, "it connected anew", clock(), out);
    }
    machine_of_[worker] = i;
    process_of_[worker] = machines_[i].process;
    heard_at_[worker] = now_;
    forget_losses(machines_[i].process);
    ledger_->join(worker, machines_[i].traits, clock(), out);
    perform(out);
    heartbeat(i);
  });
}

// `crashed`: the process is gone, or the link broke without a word.
void World::cut(size_t i, bool crashed) {
  Machine& m = machines_[i];
  const uint64_t link = m.link;
  if (!link) return;
  m.link = 0;
  const WorkerId worker = worker_of_.count(link) ? worker_of_[link] : 0;
  worker_of_.erase(link);
  at(now_ + static_cast<int64_t>(draw(200)), [this, i] { connect(i); });
  if (!up_ || !machine_of_.count(worker)) return;
  const auto tell = [this, worker, crashed, process = process_of_[worker], epoch = epoch_] {
    if (up_ && epoch == epoch_) notice_break(worker, crashed, process);
  };
  // The coordinator may learn of it late.
  chance(0.7) ? at(now_, tell) : at(now_ + static_cast<int64_t>(draw(1500)), tell);
}

// A unit that three workers died with is given up, and rightly: chance must not kill three holders of a sound
// one. A holder is whom the coordinator granted it to, even if the process was dead by then and never saw it,
// because the coordinator cannot tell. So where a unit's losses are used up, the news of the break is lost,
// and the coordinator finds the worker silent instead, which is no unit's fault.
void World::notice_break(WorkerId worker, bool crashed, uint64_t process) {
  if (!machine_of_.count(worker)) return;  // the process is back and said so
  if (crashed && ledger_->held(worker) > 0 && !count_losses(worker, process))
    return at(now_ + 100, [this, worker, crashed, process, epoch = epoch_] {
      if (up_ && epoch == epoch_) notice_break(worker, crashed, process);
    });
  machine_of_.erase(worker);
  heard_at_.erase(worker);
  granted_.erase(worker);
  Actions out;
  ledger_->leave(worker, crashed, "the connection broke", clock(), out);
  perform(out);
}

bool World::count_losses(WorkerId worker, uint64_t process) {
  for (const Key& unit : granted_[worker])
    if (!poison_.count(unit) && lost_[unit] >= kMostLosses) return false;
  for (const Key& unit : granted_[worker]) {
    ++lost_[unit];
    may_return_.push_back({process, longest_ms(), unit});
  }
  return true;
}

// The process is back before its losses were judged.
void World::forget_losses(uint64_t process) {
  std::erase_if(may_return_, [&](const Lost& lost) {
    const bool returned = lost.process == process && longest_ms() - lost.when < rules_.lease_ms;
    if (returned) --lost_[lost.unit];
    return returned || lost.process == process;
  });
}

void World::to_machine(WorkerId worker, std::function<void(Machine&, size_t)> what) {
  const auto it = machine_of_.find(worker);
  if (it == machine_of_.end()) return;
  const size_t i = it->second;
  const uint64_t link = machines_[i].link;
  if (!link || !worker_of_.count(link) || worker_of_[link] != worker) return;  // broken, not yet noticed
  at(std::max(now_ + 1, machines_[i].stalled_until), [this, i, link, what = std::move(what)] {
    if (machines_[i].alive && machines_[i].link == link) what(machines_[i], i);
  });
}

void World::to_coordinator(size_t i, std::function<void(Actions&)> what) {
  const uint64_t link = machines_[i].link;
  if (!link) return;
  at(std::max(now_ + 1, machines_[i].stalled_until), [this, i, link, epoch = epoch_, what = std::move(what)] {
    if (!up_ || epoch != epoch_ || machines_[i].link != link) return;
    if (const auto worker = worker_of_.find(link);
        worker != worker_of_.end() && machine_of_.count(worker->second))
      heard_at_[worker->second] = now_;
    Actions out;
    what(out);
    perform(out);
  });
}

void World::heartbeat(size_t i) {
  const uint64_t link = machines_[i].link;
  if (!link || !worker_of_.count(link) || !machines_[i].alive) return;
  const WorkerId worker = worker_of_[link];
  to_coordinator(i, [this, worker](Actions& out) { ledger_->heard(worker, clock(), out); });
  at(now_ + rules_.lease_ms / 4, [this, i, link] {
    if (machines_[i].link == link) heartbeat(i);
  });
}

// Whether a failure of the unit may be added to its losses, and adds it.
bool World::may_lose(const Grant& grant) {
  int& lost = lost_[{grant.job, grant.unit}];
  if (lost >= kMostLosses) return false;
  ++lost;
  return true;
}

void World::work(size_t i) {
  Machine& m = machines_[i];
  while (m.alive && m.running.size() < m.traits.threads && !m.queue.empty()) {
    const Grant grant = m.queue.front();
    m.queue.pop_front();
    if (poison(grant.job, grant.unit) && chance(0.5)) return crash(i);
    m.running.push_back(grant);
    const bool hangs = now_ < faults_end_ && chance(0.002) && may_lose(grant);
    m.hung |= hangs;
    if (hangs) continue;  // it stays in `running` until the coordinator has had enough of the machine
    at(now_ + 1 + m.unit_ms / 2 + static_cast<int64_t>(draw(static_cast<uint64_t>(m.unit_ms))),
       [this, i, grant, process = m.process] {
         if (machines_[i].alive && machines_[i].process == process) finished(i, grant);
       });
  }
}

void World::finished(size_t i, const Grant& grant) {
  Machine& m = machines_[i];
  const auto running = std::find_if(m.running.begin(), m.running.end(), [&](const Grant& g) {
    return g.lease == grant.lease && g.job == grant.job;
  });
  if (running == m.running.end()) return;
  m.running.erase(running);
  const WorkerId worker = m.link && worker_of_.count(m.link) ? worker_of_[m.link] : 0;
  if (poison(grant.job, grant.unit) || (now_ < faults_end_ && chance(0.003) && may_lose(grant))) {
    to_coordinator(i, [this, worker, grant](Actions& out) {
      granted_[worker].erase({grant.job, grant.unit});
      ledger_->unit_failed(worker, grant.job, grant.unit, Error{ErrorKind::kNoSpace, "memory"}, clock(), out);
    });
    return work(i);
  }
  ++figures_.answers;
  Digest digest = truth(grant.job, grant.unit);
  if (m.ring ? (grant.unit + grant.job) % 3 == 0 : m.liar && chance(0.3)) {
    ++figures_.lies;
    digest.bytes[m.ring ? 2 : 0] ^= static_cast<uint8_t>(m.ring ? m.ring : 1 + i);
    if (m.contrary) digest.bytes[1] ^= static_cast<uint8_t>(draw(256));
  }
  std::erase_if(m.kept, [&](const Kept& k) { return k.job == grant.job && k.unit == grant.unit; });
  m.kept.push_back({grant.job, grant.unit, grant.lease, digest, false});
  deliver_kept(i, grant.job);
  echo(i, grant.job, grant.unit, digest);
  work(i);
}

void World::take_result(WorkerId worker, JobId job, uint64_t unit, const Digest& digest, Actions& out) {
  const size_t before = ledger_->held(worker);
  ledger_->result(worker, job, unit, digest, clock(), out);
  const auto is_grant = [&](const Action& action) {
    const auto* grant = std::get_if<Grant>(&action);
    return grant && grant->worker == worker;
  };
  const auto more = static_cast<size_t>(std::count_if(out.begin(), out.end(), is_grant));
  // A result that does not count yet leaves the worker its unit.
  if (ledger_->held(worker) < before + more) granted_[worker].erase({job, unit});
}

// The other machines of a ring confirm what one of them says, though nobody asked them.
void World::echo(size_t i, JobId job, uint64_t unit, const Digest& digest) {
  if (machines_[i].ring == 0) return;
  for (size_t j = 0; j < machines_.size(); ++j) {
    const Machine& m = machines_[j];
    const WorkerId worker = m.link && worker_of_.count(m.link) ? worker_of_[m.link] : 0;
    if (j == i || m.ring != machines_[i].ring || !worker) continue;
    to_coordinator(j, [this, worker, job, unit, digest](Actions& out) {
      if (ledger_->is_member(worker) && ledger_->knows(job, unit))
        take_result(worker, job, unit, digest, out);
    });
  }
}

void World::deliver_kept(size_t i, JobId job) {
  Machine& m = machines_[i];
  const WorkerId worker = m.link && worker_of_.count(m.link) ? worker_of_[m.link] : 0;
  if (!worker || !up_ || !ledger_->is_member(worker)) return;
  for (Kept& kept : m.kept) {
    if (kept.job != job || kept.sent) continue;
    kept.sent = true;
    const int times = now_ < faults_end_ && chance(0.05) ? 3 : 1;
    for (int t = 0; t < times; ++t)
      to_coordinator(i, [this, worker, k = kept](Actions& out) {
        // A result of a unit that this coordinator has not cut yet is kept back until it has (server:
        // parked).
        if (!ledger_->has_job(k.job) || ledger_->knows(k.job, k.unit))
          take_result(worker, k.job, k.unit, k.digest, out);
      });
  }
}

void World::crash(size_t i) {
  ++figures_.kills;
  end_process(i, true);
}

// Its supervisor starts it anew.
void World::end_process(size_t i, bool crashed) {
  Machine& m = machines_[i];
  m.queue.clear();
  m.running.clear();
  m.kept.clear();
  m.job = 0;
  m.hung = false;
  m.traits.process = m.process = next_process_++;
  cut(i, crashed);
}

// Without a word, and the connection does not break: a pulled cable. The coordinator learns of it long after.
void World::vanish(size_t i) {
  Machine& m = machines_[i];
  if (!m.link) return;
  m.alive = false;
  at(now_ + 3000 + static_cast<int64_t>(draw(10000)), [this, i] {
    machines_[i].alive = true;
    end_process(i, true);
    if (!machines_[i].link) connect(i);
  });
}

// The coordinator is stopped for a while and does not know, or its machine's clock is wrong.
void World::leap() {
  ++figures_.leaps;
  const auto ms =
      static_cast<int64_t>(draw(chance(0.5) ? 2 * static_cast<uint64_t>(rules_.lease_ms) : 1000000));
  if (chance(0.2)) {
    clock_ahead_ -= ms;
    return;
  }
  clock_ahead_ += ms;
  leapt_ += ms;
}

// After a restart, pages of the disk have an older content or cannot be read.
void World::tear_disk() {
  if (now_ >= faults_end_ || !chance(0.3)) return;
  for (auto& [key, rows] : disk_.rows) {
    if (disk_.done.count(key.first)) continue;
    for (Row& row : rows)
      if (chance(0.05)) ++figures_.torn, row.settled = row.verified = false;
    figures_.torn += std::erase_if(rows, [&](const Row&) { return chance(0.05); });
  }
  figures_.torn += std::erase_if(disk_.agreed, [&](const auto&) { return chance(0.05); });
}

// Its import fails, or its owner cancels it.
void World::cut_short(JobId id) {
  if (!up_ || !ledger_->has_job(id) || disk_.done.count(id)) return;
  ++figures_.cut_short;
  Actions out;
  ledger_->end_job(id, conductors_.at(id).importing ? "failed: no mesh" : "cancelled", clock(), out);
  write([id](Disk& disk) { disk.done.insert(id); }, nullptr);
  perform(out);
}

// Draws a fault now and then, each world with its own mix.
void World::make_trouble() {
  if (now_ >= faults_end_) {
    full_ = false;
    for (Machine& m : machines_) m.stalled_until = 0;
    return;
  }
  const size_t i = draw(machines_.size());
  const uint64_t kind = draw(100), mix = seed_ % 4;
  if (kind < 12) {
    crash(i);
  } else if (kind < 30) {
    cut(i, true);
  } else if (kind < 50) {
    machines_[i].stalled_until = now_ + static_cast<int64_t>(draw(mix == 1 ? 6000 : 1500));
  } else if (kind < 56 && mix != 2) {
    kill_coordinator();
  } else if (kind < 60) {
    full_ = true;
    at(now_ + static_cast<int64_t>(draw(800)), [this] { full_ = false; });
  } else if (kind < 63) {
    vanish(i);
  } else if (kind < 69 && up_) {
    const JobId job = 1 + draw(conductors_.size());
    const bool pause = chance(0.5);
    Actions out;
    ledger_->change_job(job, static_cast<int32_t>(draw(100)), pause, clock(), out);
    perform(out);
    at(now_ + static_cast<int64_t>(draw(500)), [this, job, epoch = epoch_] {
      if (!up_ || epoch != epoch_) return;
      Actions back;
      ledger_->change_job(job, conductors_[job].traits.priority, false, clock(), back);
      perform(back);
    });
  } else if (kind < 73 && up_ && machines_[i].link && worker_of_.count(machines_[i].link)) {
    std::vector<uint64_t> unbegun;
    for (const Grant& g : machines_[i].queue) unbegun.push_back(g.unit);
    machines_[i].queue.clear();
    const WorkerId worker = worker_of_[machines_[i].link];
    to_coordinator(i,
                   [this, worker, unbegun](Actions& out) { ledger_->drain(worker, unbegun, clock(), out); });
    at(now_ + 300, [this, i] { end_process(i, false); });
  }
  if (kind >= 73 && kind < 77 && up_) leap();
  at(now_ + 20 + static_cast<int64_t>(draw(mix == 3 ? 60 : 400)), [this] { make_trouble(); });
}

}  // namespace kiln::sim

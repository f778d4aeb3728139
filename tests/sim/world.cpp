#include "tests/sim/world.h"

#include <cstdio>

#include "common/base/format.h"
#include "tests/sim/action_text.h"

namespace kiln::sim {
namespace {

constexpr uint64_t kAlwaysAudited = 2000;  // units and workers
constexpr uint64_t kDigestEvery = 20;      // batches of actions

}  // namespace

World::World(uint64_t seed, const WorldSize& size) : random_(seed * 0x9e3779b97f4a7c15u + 1), seed_(seed) {
  rules_.lease_ms = 1000;
  rules_.hang_ms = 8000;
  rules_.residence_ms = 300;
  rules_.class_patience_ms = 3000;
  rules_.audit_first = std::vector<uint32_t>{0, 2, 1000000}[draw(3)];
  rules_.audit_seed = seed;
  make_jobs(size);
  make_machines(size);
  uint64_t units = 0;
  for (const auto& [id, job] : conductors_)
    for (const auto& pass : job.passes) units += pass.size();
  const uint64_t size_of_all = units + machines_.size();
  audit_every_ = size_of_all <= kAlwaysAudited ? 1 : 4 * size_of_all;
  faults_end_ = 4000 + static_cast<int64_t>(draw(12000));
}

void World::at(int64_t when, std::function<void()> what) {
  events_.push({when, next_event_++, std::move(what)});
}

void World::fail(const std::string& sentence) {
  if (failure_.empty()) failure_ = text("at {} ms: {}", now_, sentence);
}

Digest World::truth(JobId job, uint64_t unit) const {
  const uint64_t key[3] = {seed_, job, unit};
  return sha256(std::as_bytes(std::span(key)));
}

void World::make_jobs(const WorldSize& size) {
  const uint64_t jobs = size.jobs ? size.jobs : 1 + draw(5);
  for (JobId id = 1; id <= jobs; ++id) {
    Conductor job;
    job.traits.user = text("user{}", draw(3));
    job.traits.priority = static_cast<int32_t>(draw(5)) * 10 - 20;
    job.traits.quorum = chance(0.3) ? 2 : 1;
    job.traits.poison = chance(0.5) ? PoisonPolicy::kSkip : PoisonPolicy::kFail;
    uint64_t unit = 0;
    for (uint64_t p = 0, passes = 1 + draw(3); p < passes; ++p) {
      std::vector<UnitPlan> plan;
      const uint64_t units = size.units ? size.units : 1 + draw(60);
      for (uint64_t i = 0; i < units; ++i)
        plan.push_back({++unit, 77 * unit, 1.0 + static_cast<double>(draw(3))});
      job.passes.push_back(std::move(plan));
    }
    if (job.traits.poison == PoisonPolicy::kSkip && chance(0.5)) poison_.insert({id, 1 + draw(unit)});
    if (chance(0.15)) {
      job.ends_at = static_cast<int64_t>(draw(3000));
      job.importing = chance(0.5);
    }
    conductors_[id] = std::move(job);
  }
}

// As many honest machines of the common class as a decision can need: three for a dispute.
void World::make_machines(const WorldSize& size) {
  const uint64_t count = size.workers ? size.workers : 1 + draw(16);
  uint32_t honest = 0;
  for (uint64_t i = 0; i < count; ++i) {
    Machine m;
    m.traits = {text("machine{}", i), text("machine{}", i), 1 + static_cast<uint32_t>(draw(4))};
    m.numeric_class = i > 3 && chance(0.1) ? "other" : "common";
    m.unit_ms = 3 + static_cast<int64_t>(draw(40)) * (chance(0.1) ? 20 : 1);
    // The first three are honest. Liars lie each in its own way, but for those of one owner, who agree.
    m.liar = i > 2 && chance(0.25);
    m.contrary = m.liar && chance(0.2);
    if (m.liar && !m.contrary && chance(0.6)) {
      m.ring = 1 + static_cast<uint32_t>(draw(2));
      m.traits.voter = text("owner{}", m.ring);
    }
    honest += !m.liar && m.numeric_class == "common";
    m.traits.process = m.process = next_process_++;
    machines_.push_back(std::move(m));
  }
  honest_enough_ = honest >= 3;
  if (honest_enough_) return;
  // Too few to outvote anybody: nobody lies, and a quorum that could never be had is not asked for.
  for (Machine& m : machines_) m.liar = m.contrary = false, m.ring = 0;
  if (honest < 2)
    for (auto& [id, job] : conductors_) job.traits.quorum = 1;
}

bool World::of_ring(const std::string& identity) const {
  return std::any_of(machines_.begin(), machines_.end(),
                     [&](const Machine& m) { return m.ring && m.traits.identity == identity; });
}

void World::start_coordinator() {
  up_ = true;
  ++epoch_;
  ledger_ = std::make_unique<FarmLedger>(rules_);
  machine_of_.clear();
  // Another machine, or the same started anew: its steady clock begins anywhere.
  clock_ahead_ =
      chance(0.5) ? static_cast<int64_t>(draw(1000000000)) : -now_ + static_cast<int64_t>(draw(1000));
  tear_disk();
  process_of_.clear();
  granted_.clear();
  may_return_.clear();
  worker_of_.clear();
  heard_at_.clear();
  for (const auto& [identity, agreed] : disk_.agreed) ledger_->restore_trust(identity, agreed, "");
  for (const auto& [identity, reason] : disk_.quarantined)
    ledger_->restore_trust(identity, disk_.agreed[identity], reason);
  for (auto& [id, job] : conductors_) {
    if (disk_.done.count(id)) continue;
    JobTraits traits = job.traits;
    if (disk_.classes.count(id)) traits.numeric_class = disk_.classes.at(id);
    ledger_->add_job(id, traits);
    std::vector<KnownAnswer> known;
    for (const auto& [key, rows] : disk_.rows)
      if (key.first == id)
        for (const Row& row : rows)
          known.push_back({key.second, row.shape, row.digest, row.identity, row.settled, row.verified,
                           !of_ring(row.identity)});
    ledger_->restore(id, known);
    job.pass = 0;
    job.merged.clear();
    job.skipped.clear();
    job.rotten.clear();
    if (job.ends_at >= 0)
      at(std::max(now_, job.ends_at), [this, id = id, epoch = epoch_] {
        if (epoch == epoch_) cut_short(id);
      });
    ++job.run;
    if (job.importing) continue;
    at(now_ + static_cast<int64_t>(draw(200)), [this, id = id, run = job.run, epoch = epoch_] {
      if (up_ && epoch == epoch_ && conductors_[id].run == run) begin(id);
    });
  }
  for (size_t i = 0; i < machines_.size(); ++i)
    at(now_ + static_cast<int64_t>(draw(100)), [this, i] { connect(i); });
  struct Ticker {
    World& world;
    uint64_t epoch;
    void operator()() const {
      if (!world.up_ || epoch != world.epoch_) return;
      Actions out;
      for (const auto& [worker, heard] : world.heard_at_)
        if (world.now_ - heard > 2 * world.rules_.lease_ms + 100 && world.ledger_->held(worker) > 0)
          world.fail("a worker holds units and has long been silent");
      world.ledger_->tick(world.clock(), out);
      world.perform(out);
      world.at(world.now_ + 20, *this);
    }
  };
  at(now_, Ticker{*this, epoch_});
}

void World::note_waived() {
  for (const auto& [id, job] : conductors_)
    if (ledger_->counts(id).waived > 0) waived_.insert(id);
}

void World::kill_coordinator() {
  if (!up_) return;
  note_waived();
  ++figures_.restarts;
  up_ = false;
  ledger_.reset();
  unflushed_.clear();  // a power cut: what was not flushed is gone
  flushing_ = false;
  for (Machine& m : machines_) m.link = 0;
  at(now_ + 5 + static_cast<int64_t>(draw(500)), [this] { start_coordinator(); });
}

void World::begin(JobId id) {
  Conductor& job = conductors_.at(id);
  if (!ledger_->has_job(id)) return;
  if (job.pass == job.passes.size()) {
    check_published(id);
    write([id](Disk& disk) { disk.done.insert(id); },
          [this, id] {
            Actions out;
            ledger_->end_job(id, "done", clock(), out);
            perform(out);
          });
    return;
  }
  Actions out;
  ledger_->begin_pass(id, job.passes[job.pass], clock(), out);
  perform(out);
}

void World::check_published(JobId id) {
  const Conductor& job = conductors_.at(id);
  for (const auto& pass : job.passes)
    for (const UnitPlan& plan : pass) {
      const auto merged = job.merged.find(plan.id);
      if (merged == job.merged.end()) {
        if (!job.skipped.count(plan.id)) fail(text("job {} is published without unit {}", id, plan.id));
        continue;
      }
      bool is_result = false;
      for (const Row& row : disk_.rows[{id, plan.id}]) {
        is_result |= row.digest == merged->second;
        if (row.settled && !row.verified && row.digest == merged->second &&
            disk_.quarantined.count(row.identity))
          fail(text("job {} is published with what {} alone said", id, row.identity));
      }
      if (!is_result)
        fail(text("job {} is published with a unit {} that the disk does not have", id, plan.id));
      if (merged->second == truth(id, plan.id)) continue;
      // With a dose below certainty a lie may pass, but never one that another worker was asked to confirm.
      const bool certain = job.traits.quorum > 1 || rules_.audit_first > 1000;
      note_waived();
      if (certain && !waived_.count(id)) fail(text("job {} is published with a wrong unit {}", id, plan.id));
      for (const Row& row : disk_.rows[{id, plan.id}])
        if (row.settled && row.verified && row.digest == merged->second)
          fail(text("a wrong unit {} of job {} was verified", plan.id, id));
    }
}

void World::mix(const std::string& words) {
  const std::string all = text("{} {} {}", digest_, now_, words);
  digest_ = xxh3(std::as_bytes(std::span(all)));
}

void World::mix_state() {
  const auto mix_all = [this](const std::vector<std::string>& lines) {
    for (const std::string& line : lines) mix(line);
  };
  for (const auto& [id, job] : conductors_) {
    mix_all(ledger_->why_job(id, clock()));
    const PassCounts pass = ledger_->pass(id);
    const JobCounts counts = ledger_->counts(id);
    mix(text("{} {} {} {} {} {}", pass.number, pass.units, pass.done, pass.failed, pass.weight,
             pass.weight_done));
    mix(text("{} {} {} {} {} {} {}", counts.duplicates, counts.copies, counts.reassigned, counts.lost,
             counts.disputes, ledger_->stuck_ms(id, clock()), ledger_->numeric_class(id)));
    if (job.pass < job.passes.size())
      for (const UnitPlan& plan : job.passes[job.pass]) mix_all(ledger_->why_unit(id, plan.id, clock()));
  }
  for (const auto& [worker, machine] : machine_of_) {
    mix_all(ledger_->why_worker(worker, clock()));
    const WorkerView view = ledger_->view(worker, clock());
    mix(text("{} {} {} {} {}", view.job, view.state, view.held, view.credits, view.agreed));
  }
}

void World::perform(const Actions& actions) {
  for (const Action& action : actions) {
    if (digest_on_) mix(action_text(action));
    if (trace_)
      std::fprintf(stderr, "%8lld  %s\n", static_cast<long long>(now_), action_text(action).c_str());
    carry_out(action);
  }
  if (digest_on_ && ledger_ && performed_ % kDigestEvery == 0) mix_state();
  // An audit reads every unit: small worlds after each event, large ones now and then.
  if (!ledger_ || ++performed_ % audit_every_ != 0) return;
  if (const std::string wrong = ledger_->audit(); !wrong.empty()) fail(wrong);
}

template <class... F>
struct Cases : F... {
  using F::operator()...;
};
template <class... F>
Cases(F...) -> Cases<F...>;

void World::carry_out(const Action& action) {
  std::visit(
      Cases{
          [&](const Assign& a) {
            to_machine(a.worker, [this, a](Machine& m, size_t i) {
              m.job = a.job;
              at(now_ + static_cast<int64_t>(draw(50)), [this, i, job = a.job, link = m.link] {
                Machine& machine = machines_[i];
                if (!machine.alive || machine.link != link || machine.job != job) return;
                std::vector<uint64_t> held;
                for (const Grant& g : machine.queue)
                  if (g.job == job) held.push_back(g.unit);
                for (const Grant& g : machine.running)
                  if (g.job == job) held.push_back(g.unit);
                const WorkerId worker = worker_of_.count(link) ? worker_of_[link] : 0;
                const uint32_t credits = machine.traits.threads + 2;
                to_coordinator(i,
                               [this, worker, job, c = machine.numeric_class, credits, held](Actions& out) {
                                 for (const uint64_t unit : held) granted_[worker].insert({job, unit});
                                 ledger_->ready(worker, job, c, credits, held, clock(), out);
                               });
                for (Kept& kept : machine.kept) kept.sent &= kept.job != job;
                deliver_kept(i, job);
              });
            });
          },
          [&](const Release& a) {
            to_machine(a.worker, [a](Machine& m, size_t) {
              std::erase_if(m.queue, [&](const Grant& g) { return g.job == a.job; });
              std::erase_if(m.kept, [&](const Kept& k) { return k.job == a.job; });
              if (m.job == a.job) m.job = 0;
            });
          },
          [&](const Grant& a) {
            ++figures_.grants;
            granted_[a.worker].insert({a.job, a.unit});
            if (!machine_of_.count(a.worker)) fail("a unit is given to a worker that is not connected");
            const Conductor& job = conductors_.at(a.job);
            const bool of_pass = job.pass < job.passes.size() &&
                                 std::any_of(job.passes[job.pass].begin(), job.passes[job.pass].end(),
                                             [&](const UnitPlan& plan) { return plan.id == a.unit; });
            if (!of_pass) fail(text("unit {} is given out, which is not of the present pass", a.unit));
            to_machine(a.worker, [this, a](Machine& m, size_t i) {
              m.queue.push_back(a);
              work(i);
            });
          },
          [&](const Recall& a) {
            if (const auto it = granted_.find(a.worker); it != granted_.end())
              it->second.erase({a.job, a.unit});
            to_machine(a.worker, [a](Machine& m, size_t) {
              std::erase_if(m.queue, [&](const Grant& g) { return g.job == a.job && g.unit == a.unit; });
            });
          },
          [&](const StoreAnswer& a) {
            write(
                [a](Disk& disk) {
                  auto& rows = disk.rows[{a.job, a.unit}];
                  std::erase_if(rows, [&](const Row& row) { return row.digest == a.digest; });
                  rows.push_back({a.digest, a.shape, a.identity, false, false});
                },
                [this, a] {
                  Actions out;
                  ledger_->stored(a.job, a.unit, a.ticket, clock(), out);
                  perform(out);
                });
          },
          [&](const Settle& a) {
            write(
                [a](Disk& disk) {
                  auto& rows = disk.rows[{a.job, a.unit}];
                  std::erase_if(rows, [&](const Row& row) { return row.digest != a.digest; });
                  for (Row& row : rows)
                    row.settled = true, row.verified = a.verified, row.identity = a.identity;
                },
                nullptr);
          },
          [&](const Deliver& a) {
            Conductor& job = conductors_.at(a.job);
            if (!job.merged.emplace(a.unit, a.digest).second) fail(text("unit {} is merged twice", a.unit));
            bool on_disk = false;
            for (const Row& row : disk_.rows[{a.job, a.unit}]) on_disk |= row.digest == a.digest;
            if (!on_disk) fail(text("unit {} is merged before it is on disk", a.unit));
            if (now_ >= faults_end_ || !chance(0.004)) return;
            ++figures_.rotten;
            job.merged.erase(a.unit);
            job.rotten.insert(a.unit);
            at(now_ + static_cast<int64_t>(draw(20)), [this, a, run = job.run, epoch = epoch_] {
              if (!up_ || epoch != epoch_ || conductors_[a.job].run != run) return;
              Actions out;
              ledger_->damaged(a.job, a.unit, clock(), out);
              perform(out);
            });
          },
          [&](const Revoke& a) {
            write(
                [a](Disk& disk) {
                  std::erase_if(disk.rows[{a.job, a.unit}],
                                [&](const Row& row) { return row.digest == a.digest; });
                },
                nullptr);
          },
          [&](const Rewind& a) {
            ++figures_.rewinds;
            Conductor& job = conductors_.at(a.job);
            job.pass = 0;
            job.merged.clear();
            job.skipped.clear();
            job.rotten.clear();
            at(now_ + static_cast<int64_t>(draw(30)), [this, id = a.job, run = ++job.run, epoch = epoch_] {
              if (up_ && epoch == epoch_ && conductors_[id].run == run) begin(id);
            });
          },
          [&](const PinClass& a) {
            write([a](Disk& disk) { disk.classes[a.job] = a.numeric_class; }, nullptr);
          },
          [&](const Acknowledge& a) {
            const auto rows = disk_.rows.find({a.job, a.unit});
            const bool known = rows != disk_.rows.end() && !rows->second.empty();
            if (!known && !conductors_.at(a.job).skipped.count(a.unit))
              fail(text("unit {} of job {} is acknowledged and not on disk", a.unit, a.job));
            to_machine(a.worker, [a](Machine& m, size_t) {
              std::erase_if(m.kept, [&](const Kept& k) {
                return k.job == a.job && k.unit == a.unit && k.digest == a.digest;
              });
            });
          },
          [&](const Trust& a) { write([a](Disk& disk) { disk.agreed[a.identity] = a.agreed; }, nullptr); },
          [&](const Quarantine& a) {
            ++figures_.quarantined;
            for (const Machine& m : machines_)
              if (m.traits.identity == a.identity && !m.liar)
                fail(text("{} is quarantined and honest", a.identity));
            write([a](Disk& disk) { disk.quarantined[a.identity] = a.reason; }, nullptr);
          },
          [&](const Expel& a) {
            const auto it = machine_of_.find(a.worker);
            if (it == machine_of_.end()) return;
            const Machine& m = machines_[it->second];
            if (!m.link || !worker_of_.count(m.link) || worker_of_[m.link] != a.worker) return;  // broken
            if (!m.hung && a.reason.ends_with("start it anew"))
              fail(text("{} is dismissed and does not hang: {}", m.traits.name, a.reason));
            end_process(it->second, false);
          },
          [&](const SkipUnit& a) {
            ++figures_.skipped;
            if (!poison(a.job, a.unit)) fail(text("unit {} was given up and is sound: {}", a.unit, a.reason));
            conductors_.at(a.job).skipped.insert(a.unit);
          },
          [&](const FailJob& a) { fail(text("job {} failed: {}", a.job, a.error.message)); },
          [&](const PassComplete& a) {
            Conductor& job = conductors_.at(a.job);
            if (!job.rotten.empty()) return;  // the job begins again when it tells so
            ++job.pass;
            at(now_ + static_cast<int64_t>(draw(30)), [this, id = a.job, run = job.run, epoch = epoch_] {
              if (up_ && epoch == epoch_ && conductors_[id].run == run) begin(id);
            });
          },
          [](const Note&) {},
      },
      action);
}

std::string World::run() {
  start_coordinator();
  at(0, [this] { make_trouble(); });
  const int64_t limit = faults_end_ + 900000;
  while (!events_.empty() && failure_.empty() && now_ < limit) {
    const Event event = events_.top();
    events_.pop();
    now_ = event.when;
    ++figures_.events;
    event.what();
    if (disk_.done.size() == conductors_.size()) break;
  }
  figures_.simulated_ms = now_;
  if (failure_.empty() && disk_.done.size() != conductors_.size()) {
    std::string stuck;
    for (const auto& [id, job] : conductors_) {
      if (disk_.done.count(id) || !ledger_) continue;
      for (const std::string& line : ledger_->why_job(id, clock())) stuck += "\n    " + line;
    }
    if (ledger_ && trace_)
      for (const auto& [worker, machine] : machine_of_)
        for (const std::string& line : ledger_->why_worker(worker, clock())) stuck += "\n    " + line;
    fail("a job does not end:" + stuck);
  }
  if (failure_.empty() && ledger_ && up_)
    for (const auto& [worker, machine] : machine_of_)
      if (ledger_->held(worker) != 0) fail("a worker still holds units after all jobs ended");
  return failure_;
}

}  // namespace kiln::sim

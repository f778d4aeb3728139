// The ledger against workers that die, fall silent, come back late and answer twice, under a seed.
#include <map>
#include <random>
#include <set>

#include "common/base/hash.h"
#include "coordinator/dispatch/ledger.h"

namespace kiln {
namespace {

Digest truth(uint64_t unit) {
  return sha256(std::as_bytes(std::span(&unit, 1)));
}

class Simulation {
 public:
  explicit Simulation(uint32_t seed)
      : random_(seed), settings_{400, 1000, random_() % 3 == 0}, ledger_(settings_) {}

  void run() {
    for (int i = 0, n = 1 + random_() % 8; i < n; ++i) join_new();
    for (int pass = 0; pass < 3; ++pass) run_pass();
  }

 private:
  struct Answer {
    int64_t at;
    Grant grant;
  };
  struct SimWorker {
    uint32_t threads, credits;
    bool alive = true;
    int64_t silent_until = 0;
    int slowness;                 // ms per unit
    std::vector<Answer> answers;  // not yet sent
  };

  void join_new() {
    const WorkerId id = ++last_worker_;
    const uint32_t threads = 1 + random_() % 4;
    workers_[id] = {threads, threads + 2, true, 0, 5 + static_cast<int>(random_() % 300), {}};
    Actions out;
    ledger_.join(id, "w" + std::to_string(id), "class", threads, threads + 2, now_, out);
    perform(out);
  }

  void perform(const Actions& actions) {
    for (const Action& action : actions) {
      if (const auto* g = std::get_if<Grant>(&action)) on_grant(*g);
      if (const auto* c = std::get_if<Commit>(&action))
        EXPECT_TRUE(committed_.insert(c->unit).second) << "unit committed twice: " << c->unit;
      if (const auto* f = std::get_if<FailPass>(&action)) ADD_FAILURE() << f->error.message;
    }
    for (const auto& [id, w] : workers_) EXPECT_LE(ledger_.held(id), w.credits);
  }

  void on_grant(const Grant& g) {
    SimWorker& w = workers_.at(g.worker);
    EXPECT_TRUE(w.alive) << "a unit for a dead worker";
    EXPECT_TRUE(wanted_.count(g.unit));
    EXPECT_LE(ledger_.held(g.worker), w.credits);
    const int64_t busy = w.answers.empty() ? now_ : w.answers.back().at;
    w.answers.push_back({busy + w.slowness, g});
  }

  void run_pass() {
    wanted_.clear();
    committed_.clear();
    std::vector<uint64_t> units;
    for (int i = 0, n = 1 + random_() % 60; i < n; ++i) units.push_back(++last_unit_);
    wanted_.insert(units.begin(), units.end());
    Actions out;
    ledger_.begin_pass(units, now_, out);
    perform(out);
    int64_t faults_end = now_ + 4000, limit = now_ + 600000;
    while (!ledger_.complete() && now_ < limit && !::testing::Test::HasFailure()) {
      step(now_ < faults_end);
    }
    EXPECT_TRUE(ledger_.complete()) << "did not end";
    EXPECT_EQ(committed_, wanted_);
    EXPECT_EQ(ledger_.committed(), wanted_.size());
  }

  void step(bool faults) {
    now_ += 20;
    for (auto& [id, w] : workers_) {
      if (!w.alive) continue;
      if (faults && random_() % 400 == 0) return kill(id, w);
      if (faults && random_() % 300 == 0) w.silent_until = now_ + random_() % 1500;
      if (now_ < w.silent_until) continue;
      Actions out;
      ledger_.heard(id, now_, out);
      perform(out);
      answer(id, w);
    }
    if (faults && random_() % 200 == 0) join_new();
    Actions out;
    ledger_.tick(now_, out);
    perform(out);
  }

  void answer(WorkerId id, SimWorker& w) {
    while (!w.answers.empty() && w.answers.front().at <= now_) {
      const Grant g = w.answers.front().grant;
      w.answers.erase(w.answers.begin());
      const int times = random_() % 20 == 0 ? 2 : 1;  // the network repeats
      for (int t = 0; t < times; ++t) {
        Actions out;
        if (random_() % 50 == 0 && t == 0)
          ledger_.unit_failed(id, g.lease, g.unit, Error{ErrorKind::kNoSpace, "memory"}, now_, out);
        else
          ledger_.result(id, g.lease, g.unit, truth(g.unit), now_, out);
        perform(out);
      }
    }
  }

  void kill(WorkerId id, SimWorker& w) {
    size_t alive = 0;
    for (const auto& [other, state] : workers_) alive += state.alive;
    if (alive < 2) return;  // one lives: the pass must end
    w.alive = false;
    w.answers.clear();
    Actions out;
    ledger_.leave(id, random_() % 2, "killed", now_, out);
    perform(out);
    EXPECT_EQ(ledger_.held(id), 0u);
  }

  std::mt19937 random_;
  LedgerSettings settings_;
  Ledger ledger_;
  std::map<WorkerId, SimWorker> workers_;
  std::set<uint64_t> wanted_, committed_;
  WorkerId last_worker_ = 0;
  uint64_t last_unit_ = 0;
  int64_t now_ = 0;
};

TEST(LedgerSimulation, EveryUnitIsCommittedOnceWhileOneWorkerLives) {
  const char* from_environment = std::getenv("KILN_SEEDS");
  const uint32_t seeds = from_environment ? static_cast<uint32_t>(std::atoi(from_environment)) : 200;
  for (uint32_t seed = 1; seed <= seeds; ++seed) {
    Simulation(seed).run();
    ASSERT_FALSE(HasFailure()) << "failing seed: " << seed;
  }
}

}  // namespace
}  // namespace kiln

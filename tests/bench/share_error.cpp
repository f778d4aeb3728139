#include "tests/bench/share_error.h"

#include <cmath>
#include <deque>
#include <functional>
#include <queue>
#include <random>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln::bench {
namespace {

constexpr double kUnitMs = 1000;  // of a worker of speed 1
constexpr uint32_t kUnitsOfPass = 400, kThinUnits = 2;
constexpr int64_t kTickMs = 20, kMergeMs = 200, kSceneMs = 300;

class ShareWorld {
 public:
  explicit ShareWorld(const ShareCase& c) : case_(c), ledger_(FarmRules{}), random_(1) {}

  ShareFigures run() {
    const Stopwatch watch;
    const int64_t third = case_.simulated_ms / 3;
    for (uint32_t w = 0; w < case_.workers; ++w) join(w + 1);
    const uint32_t passing = case_.users - case_.passing_users;
    for (uint32_t user = 0; user < passing; ++user) come(user);
    if (case_.passing_users > 0)
      at(third, [this, passing] {
        for (uint32_t user = passing; user < case_.users; ++user) come(user);
      });
    if (case_.passing_users > 0)
      at(2 * third, [this, passing] {
        for (uint32_t user = passing; user < case_.users; ++user) go(user);
      });
    tick();
    ShareFigures figures;
    const int parts = case_.passing_users > 0 ? 3 : 1;
    for (int part = 0; part < parts; ++part) {
      std::fill(got_ms_.begin(), got_ms_.end(), 0.0);
      const int64_t end = part == parts - 1 ? case_.simulated_ms : third * (part + 1);
      while (!events_.empty() && events_.top().when < end) {
        const Event event = events_.top();
        events_.pop();
        now_ = event.when;
        event.what();
      }
      const bool all = part == 1;
      judge(all ? case_.users : passing, figures);
    }
    figures.units = units_;
    figures.units_per_second = static_cast<double>(units_) / watch.seconds();
    return figures;
  }

 private:
  struct Machine {
    uint32_t threads = 1;
    double speed = 1;
    JobId job = 0;
    std::deque<Grant> waiting;
    uint32_t running = 0;
  };
  struct Event {
    int64_t when;
    uint64_t number;
    std::function<void()> what;
    bool operator<(const Event& o) const { return std::tie(o.when, o.number) < std::tie(when, number); }
  };

  uint32_t user_of(JobId job) const { return static_cast<uint32_t>((job - 1) / case_.jobs_each); }
  bool thin(uint32_t user) const { return user < case_.thin_users; }
  int32_t priority(uint32_t user) const { return case_.priorities ? 10 * static_cast<int32_t>(user % 3) : 0; }
  void at(int64_t when, std::function<void()> what) { events_.push({when, number_++, std::move(what)}); }

  void join(WorkerId id) {
    Machine& m = machines_[id];
    m.threads = 1u << random_() % 5;
    m.speed = 1 + static_cast<double>(random_() % 4);
    Actions out;
    ledger_.join(id, {text("machine{}", id), text("machine{}", id), m.threads, id}, now_, out);
    perform(out);
  }

  void come(uint32_t user) {
    for (uint32_t j = 0; j < case_.jobs_each; ++j) {
      const JobId job = user * case_.jobs_each + j + 1;
      JobTraits traits;
      traits.user = text("user{}", user);
      traits.priority = priority(user);
      traits.numeric_class = "load";
      ledger_.add_job(job, traits);
      begin(job);
    }
  }

  void go(uint32_t user) {
    for (uint32_t j = 0; j < case_.jobs_each; ++j) {
      Actions out;
      ledger_.end_job(user * case_.jobs_each + j + 1, "it goes", now_, out);
      perform(out);
    }
  }

  void begin(JobId job) {
    if (!ledger_.has_job(job)) return;
    std::vector<UnitPlan> plan(thin(user_of(job)) ? kThinUnits : kUnitsOfPass);
    for (UnitPlan& unit : plan) unit = {++last_unit_, 1, kUnitMs};
    Actions out;
    ledger_.begin_pass(job, plan, now_, out);
    perform(out);
  }

  void tick() {
    Actions out;
    for (const auto& [id, machine] : machines_) ledger_.heard(id, now_, out);
    ledger_.tick(now_, out);
    perform(out);
    at(now_ + kTickMs, [this] { tick(); });
  }

  void work(WorkerId id) {
    Machine& m = machines_.at(id);
    while (m.running < m.threads && !m.waiting.empty()) {
      const Grant grant = m.waiting.front();
      m.waiting.pop_front();
      ++m.running;
      const double ms = kUnitMs / m.speed * (0.8 + 0.4 * static_cast<double>(random_() % 1000) / 1000);
      at(now_ + static_cast<int64_t>(ms), [this, id, grant, ms] { finished(id, grant, ms); });
    }
  }

  void finished(WorkerId id, const Grant& grant, double ms) {
    ++units_;
    got_ms_[user_of(grant.job)] += ms;
    --machines_.at(id).running;
    Actions out;
    ledger_.result(id, grant.job, grant.unit, {}, now_, out);
    perform(out);
    work(id);
  }

  void perform(const Actions& actions) {
    for (const Action& action : actions) {
      if (const auto* a = std::get_if<Assign>(&action)) {
        machines_.at(a->worker).job = a->job;
        at(now_ + kSceneMs, [this, a = *a] {
          const Machine& m = machines_.at(a.worker);
          Actions out;
          ledger_.ready(a.worker, a.job, "load", m.threads + 2, {}, now_, out);
          perform(out);
        });
      } else if (const auto* g = std::get_if<Grant>(&action)) {
        machines_.at(g->worker).waiting.push_back(*g);
        work(g->worker);
      } else if (const auto* r = std::get_if<Recall>(&action)) {
        std::erase_if(machines_.at(r->worker).waiting,
                      [&](const Grant& g) { return g.job == r->job && g.unit == r->unit; });
      } else if (const auto* e = std::get_if<Release>(&action)) {
        std::erase_if(machines_.at(e->worker).waiting, [&](const Grant& g) { return g.job == e->job; });
      } else if (const auto* s = std::get_if<StoreAnswer>(&action)) {
        Actions out;
        ledger_.stored(s->job, s->unit, s->ticket, now_, out);
        perform(out);
      } else if (const auto* c = std::get_if<PassComplete>(&action)) {
        at(now_ + kMergeMs, [this, job = c->job] { begin(job); });
      } else {
        KILN_CHECK(!std::holds_alternative<FailJob>(action) && !std::holds_alternative<Expel>(action));
      }
    }
  }

  // Whoever asks for little has it; the rest is divided by weight among the others.
  void judge(uint32_t present, ShareFigures& figures) const {
    double weights = 0, sum = 0;
    for (uint32_t user = case_.thin_users; user < present; ++user) {
      weights += FairShare::weight(priority(user));
      sum += got_ms_[user];
    }
    for (uint32_t user = case_.thin_users; user < present; ++user) {
      const double fair = sum * FairShare::weight(priority(user)) / weights;
      const double error = std::abs(got_ms_[user] - fair) / fair;
      if (error <= figures.worst_error) continue;
      figures.worst_error = error;
      figures.worst_user = text("user{}", user);
    }
  }

  const ShareCase case_;
  FarmLedger ledger_;
  std::mt19937_64 random_;
  std::map<WorkerId, Machine> machines_;
  std::vector<double> got_ms_ = std::vector<double>(case_.users);
  std::priority_queue<Event> events_;
  uint64_t number_ = 0, last_unit_ = 0, units_ = 0;
  int64_t now_ = 0;
};

}  // namespace

std::vector<ShareCase> share_cases() {
  return {{.name = "all always have work"},
          {.name = "of different priorities", .priorities = true},
          {.name = "some have little work", .thin_users = 20},
          {.name = "half are there a third of the time", .passing_users = 25, .simulated_ms = 900000},
          {.name = "few large users", .users = 3, .jobs_each = 2, .workers = 16}};
}

ShareFigures measure_share(const ShareCase& c) {
  return ShareWorld(c).run();
}

}  // namespace kiln::bench

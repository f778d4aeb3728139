// A ledger with its clock, and workers that do what they are told.
#pragma once

#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln::test {

inline Digest digest_of(int n) {
  Digest d;
  d.bytes[0] = static_cast<uint8_t>(n);
  return d;
}

template <class T>
std::vector<T> all(const Actions& actions) {
  std::vector<T> found;
  for (const Action& a : actions)
    if (const T* t = std::get_if<T>(&a)) found.push_back(*t);
  return found;
}

inline bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline FarmRules quick_rules() {
  FarmRules rules;
  rules.lease_ms = 1000;
  rules.residence_ms = 500;
  rules.hang_ms = 20000;
  rules.class_patience_ms = 5000;
  return rules;
}

struct LedgerBench {
  FarmLedger ledger;
  int64_t now = 0;
  Actions last;

  explicit LedgerBench(const FarmRules& rules = quick_rules()) : ledger(rules) {}

  void job(JobId id, const std::vector<uint64_t>& units, const std::string& user = "ada", uint32_t quorum = 1,
           int32_t priority = 0) {
    JobTraits traits;
    traits.user = user;
    traits.quorum = quorum;
    traits.priority = priority;
    ledger.add_job(id, traits);
    pass(id, units);
  }
  Actions& pass(JobId id, const std::vector<uint64_t>& units) {
    std::vector<UnitPlan> plan;
    for (const uint64_t unit : units) plan.push_back({unit, unit, 1});
    last.clear();
    ledger.begin_pass(id, plan, now, last);
    return settle();
  }
  Actions& join(WorkerId w, uint32_t threads = 1, uint32_t credits = 1,
                const std::string& numeric_class = "c", uint64_t process = 0) {
    last.clear();
    ledger.join(w, {"w" + std::to_string(w), "w" + std::to_string(w), threads, process ? process : w}, now,
                last);
    credits_[w] = credits;
    class_[w] = numeric_class;
    return settle();
  }
  void expect(WorkerId w) { credits_[w] = 1, class_[w] = "c"; }  // of a join by hand
  Actions& result(const Grant& g, int digest = 1) {
    last.clear();
    ledger.result(g.worker, g.job, g.unit, digest_of(digest), now, last);
    return settle();
  }
  Actions& lose(WorkerId w) {
    last.clear();
    ledger.leave(w, true, "gone", now, last);
    return settle();
  }
  Actions& wait(int64_t ms, std::vector<WorkerId> alive = {}) {
    last.clear();
    for (const int64_t end = now + ms; now < end;) {
      now += 100;
      for (const WorkerId w : alive) ledger.heard(w, now, last);
      ledger.tick(now, last);
      settle();
    }
    return last;
  }
  // Workers are ready at once and the disk writes at once.
  Actions& settle() {
    for (size_t i = 0; i < last.size(); ++i) {
      const Action action = last[i];
      if (const auto* a = std::get_if<Assign>(&action))
        ledger.ready(a->worker, a->job, class_[a->worker], credits_[a->worker], {}, now, last);
      if (const auto* s = std::get_if<StoreAnswer>(&action); s && disk)
        ledger.stored(s->job, s->unit, s->ticket, now, last);
      if (const auto* e = std::get_if<Expel>(&action)) ledger.leave(e->worker, false, e->reason, now, last);
    }
    EXPECT_EQ(ledger.audit(), "");
    return last;
  }
  bool disk = true;

 private:
  std::map<WorkerId, uint32_t> credits_;
  std::map<WorkerId, std::string> class_;
};

}  // namespace kiln::test

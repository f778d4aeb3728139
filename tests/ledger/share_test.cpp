// Several jobs of several users on one farm, in virtual time.
#include <cmath>
#include <random>

#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

// Workers of given speeds serve jobs without end; thread time by user.
std::map<std::string, double> serve(LedgerBench& b, const std::vector<int64_t>& unit_ms,
                                    const std::vector<std::string>& users, int64_t ms) {
  struct Busy {
    int64_t until;
    Grant grant;
  };
  std::map<WorkerId, std::vector<Busy>> busy;
  const auto take = [&](const Actions& actions) {
    for (const Grant& g : all<Grant>(actions)) {
      const int64_t since = busy[g.worker].empty() ? b.now : busy[g.worker].back().until;
      busy[g.worker].push_back({since + unit_ms[g.worker - 1], g});
    }
    for (const Recall& r : all<Recall>(actions))
      std::erase_if(busy[r.worker],
                    [&](const Busy& x) { return x.grant.job == r.job && x.grant.unit == r.unit; });
  };
  for (WorkerId w = 1; w <= unit_ms.size(); ++w) take(b.join(w, 1, 2));
  for (const int64_t end = b.now + ms; b.now < end;) {
    b.now += 10;
    for (WorkerId w = 1; w <= unit_ms.size(); ++w) {
      b.last.clear();
      b.ledger.heard(w, b.now, b.last);
      while (!busy[w].empty() && busy[w].front().until <= b.now) {
        const Grant g = busy[w].front().grant;
        busy[w].erase(busy[w].begin());
        take(b.result(g));
      }
    }
    if (b.now % 50 == 0) {
      b.last.clear();
      b.ledger.tick(b.now, b.last);
      take(b.settle());
    }
  }
  std::map<std::string, double> used;
  for (const std::string& user : users) used[user] = b.ledger.used_thread_ms(user);
  return used;
}

std::vector<uint64_t> many_units(size_t count) {
  std::vector<uint64_t> units(count);
  for (size_t i = 0; i < count; ++i) units[i] = i + 1;
  return units;
}

TEST(FairShare, UsersShareEquallyHoweverManyJobsEachHas) {
  LedgerBench b;
  JobId id = 1;
  for (int i = 0; i < 5; ++i) b.job(id++, many_units(2000), "many");
  b.job(id++, many_units(2000), "one");
  const auto used = serve(b, {100, 70, 130, 90, 110}, {"many", "one"}, 60000);
  const double total = used.at("many") + used.at("one");
  EXPECT_GT(total, 0.9 * 5 * 60000);  // the farm is not idle for fairness' sake
  EXPECT_NEAR(used.at("one") / total, 0.5, 0.05);
}

TEST(FairShare, TenPointsOfPriorityDoubleAShare) {
  LedgerBench b;
  b.job(1, many_units(4000), "high", 1, 10);
  b.job(2, many_units(4000), "low", 1, 0);
  const auto used = serve(b, {100, 100, 100}, {"high", "low"}, 60000);
  EXPECT_NEAR(used.at("high") / used.at("low"), 2, 0.2);
}

TEST(FairShare, OneWorkerIsSharedByTurns) {
  LedgerBench b;
  b.job(1, many_units(2000), "ada");
  b.job(2, many_units(2000), "ben");
  const auto used = serve(b, {50}, {"ada", "ben"}, 30000);
  EXPECT_NEAR(used.at("ada") / (used.at("ada") + used.at("ben")), 0.5, 0.05);
}

TEST(FairShare, WhoComesLaterDoesNotCatchUpOnTimeItDidNotAskFor) {
  LedgerBench b;
  b.job(1, many_units(4000), "early");
  serve(b, {100, 100}, {"early"}, 20000);
  LedgerBench c;
  c.job(1, many_units(9000), "early");
  FairShare share;
  const UserId early = share.intern("early"), late = share.intern("late");
  share.wake(early);
  share.charge(early, 20000, 1);
  share.wake(late);
  EXPECT_EQ(share.virtual_time(late), share.virtual_time(early));
}

TEST(FairShare, AUsersUrgentJobGoesFirst) {
  LedgerBench b;
  b.job(1, many_units(50), "ada");
  b.job(2, many_units(50), "ada", 1, 5);
  const auto grants = all<Grant>(b.join(1));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].job, 2u);
}

TEST(FairShare, APausedJobGetsNothingAndItsWorkersServeOthers) {
  LedgerBench b;
  b.job(1, many_units(10), "ada");
  const auto g = all<Grant>(b.join(1));
  b.job(2, many_units(10), "ben");
  b.last.clear();
  b.ledger.change_job(1, 0, true, b.now, b.last);
  b.settle();
  const auto next = all<Grant>(b.result(g.at(0)));
  ASSERT_EQ(next.size(), 1u);
  EXPECT_EQ(next[0].job, 2u);
  const auto why = b.ledger.why_job(1, b.now);
  EXPECT_TRUE(std::any_of(why.begin(), why.end(),
                          [](const std::string& s) { return s.find("paused") != std::string::npos; }));
}

TEST(FairShare, TheEndOfAJobFreesItsWorkers) {
  LedgerBench b;
  b.job(1, many_units(10), "ada");
  b.join(1);
  b.job(2, many_units(10), "ben");
  b.last.clear();
  b.ledger.end_job(1, "cancelled", b.now, b.last);
  const Actions& out = b.settle();
  EXPECT_EQ(all<Release>(out).size(), 1u);
  ASSERT_EQ(all<Grant>(out).size(), 1u);
  EXPECT_EQ(all<Grant>(out)[0].job, 2u);
}

}  // namespace
}  // namespace kiln

#include "coordinator/dispatch/ledger.h"

#include <algorithm>

namespace kiln {
namespace {

Digest digest_of(int n) {
  Digest d;
  d.bytes[0] = static_cast<uint8_t>(n);
  return d;
}

struct Bench {
  LedgerSettings settings{1000, 3, false};
  Ledger ledger;
  int64_t now = 0;
  Actions last;

  explicit Bench(std::vector<uint64_t> units, LedgerSettings s = {1000, 3, false}) : settings(s), ledger(s) {
    ledger.begin_pass(units, now, last);
  }
  Actions& join(WorkerId w, uint32_t threads, uint32_t credits, const std::string& cls = "c") {
    last.clear();
    ledger.join(w, "worker " + std::to_string(w), cls, threads, credits, now, last);
    return last;
  }
  Actions& result(const Grant& g, int digest = 1) {
    last.clear();
    ledger.result(g.worker, g.lease, g.unit, digest_of(digest), now, last);
    return last;
  }
  Actions& lose(WorkerId w) {
    last.clear();
    ledger.leave(w, true, "gone", now, last);
    return last;
  }
  Actions& wait(int64_t ms, std::vector<WorkerId> alive = {}) {
    last.clear();
    for (int64_t end = now + ms; now < end;) {
      now += 100;
      for (WorkerId w : alive) ledger.heard(w, now, last);
      ledger.tick(now, last);
    }
    return last;
  }
};

template <class T>
std::vector<T> all(const Actions& actions) {
  std::vector<T> found;
  for (const Action& a : actions)
    if (const T* t = std::get_if<T>(&a)) found.push_back(*t);
  return found;
}

TEST(Ledger, UnitsGoOutInOrderAndNeverAboveTheCredits) {
  Bench b({1, 2, 3, 4, 5});
  const auto grants = all<Grant>(b.join(1, 1, 3));
  ASSERT_EQ(grants.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(grants[i].unit, i + 1);
  const auto& next = b.result(grants[0]);
  EXPECT_EQ(all<Commit>(next).size(), 1u);
  EXPECT_EQ(all<Acknowledge>(next).size(), 1u);
  EXPECT_EQ(all<Grant>(next).size(), 1u);
  EXPECT_EQ(b.ledger.held(1), 3u);
}

TEST(Ledger, AFewUnitsSpreadOverAllWorkers) {
  Bench b({});
  b.join(1, 1, 3);
  b.join(2, 1, 3);
  Actions out;
  b.ledger.begin_pass(std::vector<uint64_t>{1, 2}, 0, out);
  EXPECT_EQ(b.ledger.held(1), 1u);
  EXPECT_EQ(b.ledger.held(2), 1u);
}

TEST(Ledger, ASilentWorkersUnitsGoToAnother) {
  Bench b({1, 2});
  const auto first = all<Grant>(b.join(1, 1, 2));
  ASSERT_EQ(first.size(), 2u);
  b.join(2, 1, 2);
  EXPECT_TRUE(all<Grant>(b.wait(1000, {2})).empty());  // not yet
  const auto moved = all<Grant>(b.wait(200, {2}));
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].worker, 2u);
  EXPECT_EQ(moved[0].unit, 1u);  // in their order
  EXPECT_NE(moved[0].lease, first[0].lease);
  EXPECT_EQ(b.ledger.reassigned(), 2u);
}

TEST(Ledger, ALateResultIsCommittedIfNobodyWasFaster) {
  Bench b({1});
  const auto first = all<Grant>(b.join(1, 1, 1));
  b.join(2, 1, 1);
  const auto moved = all<Grant>(b.wait(1300, {2}));
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_EQ(all<Commit>(b.result(first[0], 5)).size(), 1u);  // the old lease number does not matter
  EXPECT_TRUE(b.ledger.complete());
  const auto& second = b.result(moved[0], 5);
  EXPECT_TRUE(all<Commit>(second).empty());
  EXPECT_TRUE(all<FailPass>(second).empty());
  EXPECT_EQ(all<Acknowledge>(second).size(), 1u);  // so that the worker forgets it
  EXPECT_EQ(b.ledger.duplicates(), 1u);
}

TEST(Ledger, ALateResultWithOtherBytesRaisesTheAlarm) {
  Bench b({1});
  const auto first = all<Grant>(b.join(1, 1, 1));
  b.join(2, 1, 1);
  const auto moved = all<Grant>(b.wait(1300, {2}));
  ASSERT_EQ(moved.size(), 1u);
  b.result(first[0], 5);
  const auto failed = all<FailPass>(b.result(moved[0], 6));
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_NE(failed[0].error.message.find("unit 1 "), std::string::npos);
}

TEST(Ledger, AResultOfAnEarlierPassIsComparedToo) {
  Bench b({1});
  const auto first = all<Grant>(b.join(1, 1, 1));
  b.join(2, 1, 1);
  const auto moved = all<Grant>(b.wait(1300, {2}));
  b.result(moved[0], 5);
  Actions out;
  b.ledger.begin_pass(std::vector<uint64_t>{7}, b.now, out);
  EXPECT_TRUE(all<FailPass>(b.result(first[0], 5)).empty());
  EXPECT_EQ(all<FailPass>(b.result(first[0], 6)).size(), 1u);
}

TEST(Ledger, AbandonedUnitsAreAcknowledgedAndDropped) {
  Bench b({1});
  const auto first = all<Grant>(b.join(1, 1, 1));
  b.ledger.end_pass();
  const auto& late = b.result(first[0]);
  EXPECT_TRUE(all<Commit>(late).empty());
  EXPECT_EQ(all<Acknowledge>(late).size(), 1u);
  EXPECT_EQ(b.ledger.held(1), 0u);
}

TEST(Ledger, APoisonUnitFailsAfterThreeWorkersAndIsTheOneNamed) {
  std::vector<uint64_t> units{10, 11, 12, 13, 14, 15};
  Bench b(units);
  constexpr uint64_t kPoison = 12;
  WorkerId next_worker = 1;
  int deaths = 0;
  std::vector<FailPass> failed;
  std::vector<Grant> out = all<Grant>(b.join(next_worker++, 1, 3));
  while (failed.empty() && deaths < 10) {
    ASSERT_FALSE(out.empty());
    const Grant g = out.front();
    out.erase(out.begin());
    Actions actions;
    if (g.unit == kPoison) {
      ++deaths;
      out.clear();
      actions = b.lose(g.worker);
      failed = all<FailPass>(actions);
      actions = b.join(next_worker++, 1, 3);
    } else {
      actions = b.result(g);
    }
    for (const Grant& more : all<Grant>(actions)) out.push_back(more);
  }
  EXPECT_EQ(deaths, 3);
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_NE(failed[0].error.message.find("unit 12 "), std::string::npos) << failed[0].error.message;
}

TEST(Ledger, ASuspectRunsAloneThoughOthersWait) {
  Bench b({1, 2, 3, 4, 5, 6, 7});
  b.join(1, 1, 2);
  b.lose(1);  // 1 and 2 are suspects
  auto grants = all<Grant>(b.join(2, 1, 3));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_LE(grants[0].unit, 2u);
  grants = all<Grant>(b.result(grants[0]));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_LE(grants[0].unit, 2u);
  grants = all<Grant>(b.result(grants[0]));
  EXPECT_EQ(grants.size(), 3u);  // cleared: as usual again
}

TEST(Ledger, InvalidInputFailsThePassAtOnce) {
  Bench b({1});
  const auto g = all<Grant>(b.join(1, 1, 1))[0];
  Actions out;
  b.ledger.unit_failed(1, g.lease, 1, Error{ErrorKind::kInvalidInput, "site 7 does not exist"}, 0, out);
  ASSERT_EQ(all<FailPass>(out).size(), 1u);
  EXPECT_EQ(all<FailPass>(out)[0].error.kind, ErrorKind::kInvalidInput);
}

TEST(Ledger, AFailedUnitGoesToAnotherWorkerFirst) {
  Bench b({1});
  const auto g = all<Grant>(b.join(1, 1, 1))[0];
  b.join(2, 1, 1);
  Actions out;
  b.ledger.unit_failed(1, g.lease, 1, Error{ErrorKind::kNoSpace, "memory"}, 0, out);
  const auto again = all<Grant>(out);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].worker, 2u);
}

TEST(Ledger, AnotherNumericClassIsRefused) {
  Bench b({1, 2});
  b.join(1, 1, 1, "avx2");
  const auto& actions = b.join(2, 1, 1, "sse2");
  EXPECT_EQ(all<Expel>(actions).size(), 1u);
  EXPECT_TRUE(all<Grant>(actions).empty());
}

TEST(Ledger, TheTailIsCopiedOnceToAnIdleWorker) {
  Bench b({1, 2});
  const auto one = all<Grant>(b.join(1, 1, 1));
  const auto two = all<Grant>(b.join(2, 1, 1));
  b.wait(100, {1, 2});
  EXPECT_TRUE(all<Grant>(b.result(two[0])).empty());  // unit 1 is not late yet
  const auto copies = all<Grant>(b.wait(500, {1, 2}));
  ASSERT_EQ(copies.size(), 1u);
  EXPECT_EQ(copies[0].unit, 1u);
  EXPECT_EQ(copies[0].worker, 2u);
  b.result(copies[0]);
  EXPECT_TRUE(b.ledger.complete());
  EXPECT_TRUE(all<FailPass>(b.result(one[0])).empty());
}

TEST(Ledger, DrainHandsBackWithoutBlame) {
  Bench b({1, 2, 3});
  b.join(1, 1, 3);
  Actions out;
  b.ledger.drain(1, std::vector<uint64_t>{2, 3}, 0, out);
  EXPECT_EQ(b.ledger.held(1), 1u);
  EXPECT_EQ(all<Grant>(b.join(2, 1, 3)).size(), 2u);
}

TEST(Ledger, EveryUnitIsAskedTwiceWhereThatIsWanted) {
  Bench b({1, 2}, {1000, 3, true});
  auto open = all<Grant>(b.join(1, 1, 2));
  for (const Grant& g : all<Grant>(b.join(2, 1, 2))) open.push_back(g);
  size_t commits = 0, answers = 0;
  while (!open.empty()) {
    const Grant g = open.front();
    open.erase(open.begin());
    ++answers;
    const auto& actions = b.result(g);
    commits += all<Commit>(actions).size();
    for (const Grant& more : all<Grant>(actions)) open.push_back(more);
  }
  EXPECT_EQ(commits, 2u);
  EXPECT_EQ(answers, 4u);
  EXPECT_TRUE(b.ledger.complete());
}

TEST(Ledger, OurOwnAbsenceIsNobodysSilence) {
  Bench b({1});
  b.join(1, 1, 1);
  b.now += 60000;  // merging
  b.last.clear();
  b.ledger.tick(b.now, b.last);
  EXPECT_EQ(b.ledger.present(), 1u);
  EXPECT_EQ(b.ledger.held(1), 1u);
}

}  // namespace
}  // namespace kiln

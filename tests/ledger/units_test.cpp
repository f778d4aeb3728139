// One job's units: who gets them, when they go to others, what becomes of those that fail.
#include <algorithm>

#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

TEST(Ledger, UnitsGoOutInOrderAndNeverAboveTheCredits) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4, 5});
  const auto grants = all<Grant>(b.join(1, 1, 3));
  ASSERT_EQ(grants.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(grants[i].unit, i + 1);
  const auto& next = b.result(grants[0]);
  EXPECT_EQ(all<Deliver>(next).size(), 1u);
  EXPECT_EQ(all<Acknowledge>(next).size(), 1u);
  EXPECT_EQ(all<Grant>(next).size(), 1u);
  EXPECT_EQ(b.ledger.held(1), 3u);
}

TEST(Ledger, NothingIsAcknowledgedOrMergedBeforeItIsOnDisk) {
  LedgerBench b;
  b.disk = false;
  b.job(1, {1});
  const auto grants = all<Grant>(b.join(1));
  const Actions out = b.result(grants.at(0));
  ASSERT_EQ(all<StoreAnswer>(out).size(), 1u);
  EXPECT_TRUE(all<Acknowledge>(out).empty());
  EXPECT_TRUE(all<Deliver>(out).empty());
  EXPECT_FALSE(b.ledger.pass_complete(1));
  b.last.clear();
  b.ledger.stored(1, 1, all<StoreAnswer>(out)[0].ticket, b.now, b.last);
  EXPECT_EQ(all<Acknowledge>(b.last).size(), 1u);
  EXPECT_EQ(all<Deliver>(b.last).size(), 1u);
  EXPECT_EQ(all<PassComplete>(b.last).size(), 1u);
}

TEST(Ledger, AFewUnitsSpreadOverAllWorkers) {
  LedgerBench b;
  b.job(1, {1});
  const auto first = all<Grant>(b.join(1, 1, 3));
  b.join(2, 1, 3);
  b.result(first.at(0));
  b.pass(1, {2, 3, 4, 5});
  EXPECT_GE(b.ledger.held(1), 1u);
  EXPECT_GE(b.ledger.held(2), 1u);
}

TEST(Ledger, ASilentWorkersUnitsGoToAnother) {
  LedgerBench b;
  b.job(1, {1, 2});
  const auto first = all<Grant>(b.join(1, 2, 2));
  ASSERT_EQ(first.size(), 2u);
  b.join(2, 2, 2);
  const auto moved = all<Grant>(b.wait(1300, {2}));
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].worker, 2u);
  EXPECT_EQ(moved[0].unit, 1u);  // in their order
  EXPECT_EQ(b.ledger.counts(1).reassigned, 2u);
}

TEST(Ledger, ALateResultCountsIfNobodyWasFasterAndIsComparedElse) {
  LedgerBench b;
  b.job(1, {1});
  const auto first = all<Grant>(b.join(1));
  b.join(2);
  const auto moved = all<Grant>(b.wait(1300, {2}));
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_EQ(all<Deliver>(b.result(first[0], 5)).size(), 1u);
  EXPECT_TRUE(b.ledger.pass_complete(1));
  const auto& second = b.result(moved[0], 5);
  EXPECT_TRUE(all<Deliver>(second).empty());
  EXPECT_EQ(all<Acknowledge>(second).size(), 1u);  // so that the worker forgets it
  EXPECT_EQ(b.ledger.counts(1).duplicates, 1u);
  EXPECT_EQ(b.ledger.counts(1).verified, 1u);
}

TEST(Ledger, AnIdleWorkerGetsWhatAnotherHasNotBegun) {
  LedgerBench b;
  b.job(1, {1, 2, 3});
  b.join(1, 1, 3);
  b.join(2, 1, 3);
  const Actions out = b.wait(100, {1, 2});
  const auto grants = all<Grant>(out);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].unit, 3u);  // the last in the other's queue
  ASSERT_EQ(all<Recall>(out).size(), 1u);
  EXPECT_EQ(all<Recall>(out)[0].worker, 1u);
  EXPECT_EQ(b.ledger.held(1), 2u);
}

TEST(Ledger, ALateUnitIsCopiedOnceToAnIdleWorker) {
  LedgerBench b;
  b.job(1, {1, 2});
  const auto one = all<Grant>(b.join(1));
  const auto two = all<Grant>(b.join(2));
  b.wait(200, {1, 2});
  b.result(two.at(0));
  const auto copies = all<Grant>(b.wait(5000, {1, 2}));
  ASSERT_EQ(copies.size(), 1u);
  EXPECT_EQ(copies[0].unit, one.at(0).unit);
  EXPECT_EQ(copies[0].worker, 2u);
  EXPECT_EQ(b.ledger.counts(1).copies, 1u);
}

TEST(Ledger, AMachineTenTimesSlowerIsNotWaitedFor) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4, 5, 6, 7, 8});
  const auto fast = all<Grant>(b.join(1));
  const auto slow = all<Grant>(b.join(2));
  Grant of_fast = fast.at(0);
  for (int i = 0; i < 5; ++i) {  // 100 ms a unit
    b.wait(100, {1, 2});
    const auto next = all<Grant>(b.result(of_fast));
    ASSERT_EQ(next.size(), 1u);
    of_fast = next[0];
  }
  b.wait(500, {1, 2});
  const auto more =
      all<Grant>(b.result(slow.at(0)));  // 1000 ms: unit 8 would end after the fast one had done it
  EXPECT_TRUE(std::none_of(more.begin(), more.end(), [](const Grant& g) { return g.worker == 2; }));
  const auto why = b.ledger.why_worker(2, b.now);
  EXPECT_TRUE(std::any_of(why.begin(), why.end(),
                          [](const std::string& s) { return s.find("at its speed") != std::string::npos; }));
}

TEST(Ledger, APoisonUnitFailsAfterThreeWorkersAndIsTheOneNamed) {
  LedgerBench b;
  b.job(1, {10, 11, 12, 13, 14, 15});
  constexpr uint64_t kPoison = 12;
  WorkerId worker = 1;
  std::vector<Grant> out = all<Grant>(b.join(worker, 1, 3));
  std::vector<FailJob> failed;
  int deaths = 0;
  while (failed.empty() && deaths < 10) {
    const Grant g = out.front();
    out.erase(out.begin());
    if (g.unit == kPoison) {
      ++deaths;
      b.lose(worker);
      out = all<Grant>(b.join(++worker, 1, 3));
      const auto later = b.wait(1200, {worker});
      failed = all<FailJob>(later);
      for (const Grant& more : all<Grant>(later)) out.push_back(more);
    } else {
      for (const Grant& more : all<Grant>(b.result(g))) out.push_back(more);
    }
  }
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_NE(failed[0].error.message.find("unit 12 "), std::string::npos);
  EXPECT_EQ(deaths, 4);  // once among others, which proves nothing, and three times alone
}

TEST(Ledger, AProcessThatComesBackHadNotCrashed) {
  LedgerBench b;
  b.job(1, {1});
  for (WorkerId w = 1; w < 8; ++w) {  // the same process over a flapping network
    b.join(w, 1, 1, "c", 77);
    b.lose(w);
    EXPECT_TRUE(all<FailJob>(b.last).empty());
  }
  b.join(9, 1, 1, "c", 77);
  EXPECT_TRUE(all<FailJob>(b.wait(1500, {9})).empty());
}

TEST(Ledger, ASuspectRunsAloneThoughOthersWait) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4});
  b.join(1, 1, 2);
  b.lose(1);
  const auto grants = all<Grant>(b.join(2, 1, 2));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].unit, 1u);
}

TEST(Ledger, SkippedUnitsLetTheJobGoOn) {
  LedgerBench b;
  JobTraits traits;
  traits.poison = PoisonPolicy::kSkip;
  b.ledger.add_job(1, traits);
  b.pass(1, {1, 2});
  Grant g = all<Grant>(b.join(1)).at(0);
  std::vector<SkipUnit> skipped;
  for (int i = 0; i < 3; ++i) {
    b.last.clear();
    b.ledger.unit_failed(1, 1, g.unit, Error{ErrorKind::kInternal, "bug"}, b.now, b.last);
    skipped = all<SkipUnit>(b.settle());
    if (const auto next = all<Grant>(b.last); !next.empty()) g = next[0];
  }
  b.result(g);
  ASSERT_EQ(skipped.size(), 1u);
  EXPECT_EQ(skipped[0].unit, 1u);
  EXPECT_TRUE(b.ledger.pass_complete(1));
}

TEST(Ledger, AMachineThatFailsUnitAfterUnitIsBenchedAndTheUnitsAreNotBlamed) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4, 5, 6, 7, 8});
  auto bad = all<Grant>(b.join(1)).at(0);
  const auto good = all<Grant>(b.join(2)).at(0);
  bool benched = false;
  for (int i = 0; i < 3; ++i) {
    b.last.clear();
    b.ledger.unit_failed(1, 1, bad.unit, Error{ErrorKind::kNoSpace, "disk full"}, b.now, b.last);
    for (const Grant& g : all<Grant>(b.settle()))
      if (g.worker == 1) bad = g;
    benched = b.ledger.view(1, b.now).state == "benched";
  }
  EXPECT_TRUE(benched);
  EXPECT_EQ(b.ledger.held(1), 0u);
  Grant g = good;
  for (int i = 0; i < 8; ++i) {
    const auto next = all<Grant>(b.result(g));
    if (next.empty()) break;
    g = next[0];
  }
  EXPECT_TRUE(b.ledger.pass_complete(1));
  EXPECT_GT(all<Grant>(b.pass(1, {20, 21})).size(), 0u);
}

TEST(Ledger, AHungWorkerIsSentAwayThoughItsHeartbeatsCome) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  EXPECT_TRUE(all<Expel>(b.wait(20000, {1})).empty());
  EXPECT_EQ(all<Expel>(b.wait(300, {1})).size(), 1u);
}

TEST(Ledger, OurOwnAbsenceIsNobodysSilence) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.wait(100, {1});
  b.now += 60000;
  EXPECT_TRUE(all<Grant>(b.wait(100)).empty());
  EXPECT_EQ(b.ledger.held(1), 1u);
}

TEST(Ledger, DrainHandsBackWithoutBlame) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.join(1, 1, 2);
  b.last.clear();
  b.ledger.drain(1, std::vector<uint64_t>{2}, b.now, b.last);
  b.settle();
  const auto grants = all<Grant>(b.join(2, 1, 2));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].unit, 2u);
  EXPECT_TRUE(all<Grant>(b.wait(100, {1, 2})).empty());
}

TEST(Ledger, AResultOfAnotherShapeIsNotTheUnits) {
  LedgerBench b;
  b.ledger.add_job(1, {});
  const std::vector<KnownAnswer> known{{1, 1, digest_of(1), "w9", true, false},
                                       {2, 99, digest_of(1), "w9", true, false}};
  b.ledger.restore(1, known);
  const auto& out = b.pass(1, {1, 2});
  EXPECT_EQ(all<Deliver>(out).size(), 1u);
  ASSERT_EQ(all<Revoke>(out).size(), 1u);
  EXPECT_EQ(all<Revoke>(out)[0].unit, 2u);
  EXPECT_EQ(all<Grant>(b.join(1)).at(0).unit, 2u);
}

TEST(Ledger, WhatARestartedCoordinatorsWorkersHoldStaysWithThem) {
  LedgerBench b;
  b.job(1, {1, 2, 3});
  b.last.clear();
  b.ledger.join(1, {"w1", "w1", 1, 1}, 0, b.last);
  ASSERT_EQ(all<Assign>(b.last).size(), 1u);
  b.last.clear();
  b.ledger.ready(1, 1, "c", 2, std::vector<uint64_t>{3}, 0, b.last);
  EXPECT_EQ(b.ledger.held(1), 2u);
  const auto grants = all<Grant>(b.last);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].unit, 1u);  // 3 is there already
}

TEST(Ledger, WhileTheDiskIsFullNothingIsHandedOut) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.ledger.hold(true, 0, b.last);
  EXPECT_TRUE(all<Grant>(b.join(1)).empty());
  b.last.clear();
  b.ledger.hold(false, 0, b.last);
  EXPECT_EQ(all<Grant>(b.settle()).size(), 1u);
}

}  // namespace
}  // namespace kiln

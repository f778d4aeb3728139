// Time that the ledger did not live, and messages that no honest worker sends at that moment.
#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

// Nobody listened for an hour: a debugger, a sleeping machine.
void be_away(LedgerBench& b) {
  b.now += 3600000;
}

TEST(ListenedTime, NeitherLongGapsNorBackwardClocksCount) {
  ListenedTime time(100);
  EXPECT_EQ(time.advance(5000000), 0);
  EXPECT_EQ(time.advance(5000070), 70);
  EXPECT_EQ(time.at(5000100), 100);
  EXPECT_EQ(time.at(5000171), 70) << "a gap of 101 ms";
  EXPECT_EQ(time.advance(9000000), 70);
  EXPECT_EQ(time.advance(100), 70) << "the clock went back";
  EXPECT_EQ(time.advance(200), 170) << "and goes on from there";
}

TEST(ListenedTime, AProcessMayComeBackThoughTheCoordinatorWasAway) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1, 1, 1, "c", 71);
  for (WorkerId w = 1; w <= 3; ++w) {
    b.lose(w);
    be_away(b);
    b.last.clear();
    b.ledger.tick(b.now, b.last);
    b.settle();
    EXPECT_TRUE(all<FailJob>(b.last).empty());
    EXPECT_EQ(all<Grant>(b.join(w + 1, 1, 1, "c", 71)).size(), 1u) << "it was the network";
  }
}

TEST(ListenedTime, NoPatienceRunsOutWhileTheCoordinatorIsAway) {
  FarmRules rules = quick_rules();
  rules.audit_first = 2;
  LedgerBench b(rules);
  b.job(1, {1, 2});
  const auto grants = all<Grant>(b.join(1));
  b.result(grants.at(0));
  for (int i = 0; i < 4; ++i) {
    be_away(b);
    b.last.clear();
    b.ledger.tick(b.now, b.last);
    b.settle();
  }
  EXPECT_EQ(b.ledger.counts(1).waived, 0u) << "it was not alone for longer than a lease";
  EXPECT_TRUE(all<Expel>(b.last).empty());
  EXPECT_EQ(b.ledger.view(1, b.now).state, "baking");
  b.wait(1500, {1});
  EXPECT_EQ(b.ledger.counts(1).waived, 1u);
}

TEST(ListenedTime, AWorkerThatPreparesItsSceneIsWaitedForAsLongAsWeListen) {
  LedgerBench b;
  b.last.clear();
  b.ledger.join(1, {"w1", "w1", 1, 1}, b.now, b.last);
  JobTraits traits;
  traits.user = "ada";
  b.ledger.add_job(1, traits);
  const std::vector<UnitPlan> plan{{1, 1, 1}};
  b.ledger.begin_pass(1, plan, b.now, b.last);
  ASSERT_EQ(all<Assign>(b.last).size(), 1u);
  EXPECT_EQ(b.ledger.view(1, b.now).state, "preparing");
  const auto pass_time = [&](int64_t ms) {
    for (const int64_t end = b.now + ms; b.now < end;) {
      b.now += 100;
      b.ledger.heard(1, b.now, b.last);
      b.ledger.tick(b.now, b.last);
    }
  };
  be_away(b);
  pass_time(19000);
  EXPECT_TRUE(all<Release>(b.last).empty());
  pass_time(1500);
  ASSERT_EQ(all<Release>(b.last).size(), 1u);
  EXPECT_NE(all<Release>(b.last)[0].reason.find("was not ready after 20 s"), std::string::npos);
  EXPECT_EQ(b.ledger.view(1, b.now).state, "benched");
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(HostileWorker, WhoChangesItsClassWhileItHoldsUnitsHoldsThemNoMore) {
  LedgerBench b;
  b.job(1, {1, 2});
  ASSERT_EQ(all<Grant>(b.join(1, 1, 2)).size(), 2u);
  b.last.clear();
  b.ledger.ready(1, 1, "another class", 2, {}, b.now, b.last);
  b.settle();
  EXPECT_EQ(b.ledger.held(1), 0u);
  EXPECT_TRUE(b.ledger.is_banned(1, 1));
  EXPECT_EQ(all<Grant>(b.join(2, 1, 2)).size(), 2u);
}

TEST(HostileWorker, RefusalsOfJobsThatDoNotExistAreNotRemembered) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.last.clear();
  b.ledger.job_refused(1, 77, Error{ErrorKind::kInternal, "no"}, b.now, b.last);
  b.settle();
  EXPECT_FALSE(b.ledger.is_banned(1, 77));
  EXPECT_TRUE(b.last.empty());
}

TEST(HostileWorker, MessagesOfStrangersAndAboutNothingChangeNothing) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.last.clear();
  const Error error{ErrorKind::kInternal, "no"};
  b.ledger.result(9, 1, 1, digest_of(1), b.now, b.last);
  b.ledger.unit_failed(9, 1, 1, error, b.now, b.last);
  b.ledger.hand_back(9, 1, 1, b.now, b.last);
  b.ledger.job_refused(9, 1, error, b.now, b.last);
  b.ledger.ready(9, 1, "c", 1, {}, b.now, b.last);
  b.ledger.drain(9, {}, b.now, b.last);
  b.ledger.leave(9, true, "gone", b.now, b.last);
  b.ledger.heard(9, b.now, b.last);
  b.ledger.prove(9, 1, "c");
  b.ledger.prove(1, 9, "c");
  b.ledger.ready(1, 9, "c", 1, {}, b.now, b.last);
  b.ledger.unit_failed(1, 1, 9, error, b.now, b.last);
  b.ledger.unit_failed(1, 9, 1, error, b.now, b.last);
  b.ledger.hand_back(1, 1, 9, b.now, b.last);
  b.ledger.hand_back(1, 9, 9, b.now, b.last);
  b.ledger.stored(9, 1, 1, b.now, b.last);
  b.ledger.stored(1, 9, 1, b.now, b.last);
  b.ledger.stored(1, 1, 99, b.now, b.last);
  b.ledger.damaged(1, 9, b.now, b.last);
  b.ledger.damaged(9, 1, b.now, b.last);
  b.ledger.damaged(1, 1, b.now, b.last);  // it has no result
  b.ledger.end_job(9, "done", b.now, b.last);
  b.ledger.change_job(9, 0, true, b.now, b.last);
  b.ledger.abandon_pass(9, b.now, b.last);
  EXPECT_TRUE(b.last.empty());
  EXPECT_EQ(b.ledger.held(1), 1u);
  EXPECT_EQ(b.ledger.held(9), 0u);
  EXPECT_EQ(b.ledger.view(9, b.now).state, "");
  EXPECT_FALSE(b.ledger.is_banned(9, 1));
  EXPECT_FALSE(b.ledger.knows(9, 1));
  EXPECT_FALSE(b.ledger.pass_complete(9));
  EXPECT_EQ(b.ledger.pass(9).units, 0u);
  EXPECT_EQ(b.ledger.counts(9).workers, 0u);
  EXPECT_EQ(b.ledger.verification(9).verified, 0u);
  EXPECT_EQ(b.ledger.numeric_class(9), "");
  EXPECT_EQ(b.ledger.user(9), "");
  EXPECT_EQ(b.ledger.user(1), "ada");
  EXPECT_EQ(b.ledger.used_thread_ms("nobody"), 0);
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Restored, OfTwoResultsOfOneUnitTheFirstCounts) {
  LedgerBench b;
  JobTraits traits;
  traits.user = "ada";
  b.ledger.add_job(1, traits);
  const std::vector<KnownAnswer> known{{1, 1, digest_of(1), "w1", true, false},
                                       {1, 1, digest_of(2), "w2", true, true},
                                       {1, 1, digest_of(3), "w3", false, false}};
  b.ledger.restore(1, known);
  EXPECT_EQ(b.ledger.counts(1).unverified, 1u);
  EXPECT_EQ(b.ledger.counts(1).verified, 0u);
  const auto delivered = all<Deliver>(b.pass(1, {1}));
  ASSERT_EQ(delivered.size(), 1u);
  EXPECT_EQ(delivered[0].digest, digest_of(1));
}

TEST(Restored, AnswersThatDifferAreNotDecidedBeforeTheirPassBegins) {
  LedgerBench b;
  JobTraits traits;
  traits.user = "ada";
  b.ledger.add_job(1, traits);
  const std::vector<KnownAnswer> known{
      {1, 1, digest_of(1), "w1"}, {1, 1, digest_of(2), "w2"}, {1, 1, digest_of(3), "w3"}};
  b.ledger.restore(1, known);
  b.ledger.quarantine("w3", "it lied", b.now, b.last);
  EXPECT_TRUE(all<Settle>(b.last).empty());
  EXPECT_EQ(b.ledger.quarantined_for("w1"), nullptr);
  EXPECT_EQ(b.ledger.quarantined_for("w2"), nullptr);
}

TEST(Restored, ALossFromBeforeAChangeOfClassIsNotTheNewUnits) {
  FarmRules rules = quick_rules();
  rules.class_patience_ms = 300;
  LedgerBench b(rules);
  b.job(1, {1});
  b.join(1, 1, 1, "old");
  b.join(2, 1, 1, "new");
  b.join(3, 1, 1, "new");
  b.lose(1);
  const auto pinned = all<PinClass>(b.wait(500, {2, 3}));
  ASSERT_EQ(pinned.size(), 1u) << "before the loss is judged";
  EXPECT_EQ(pinned[0].numeric_class, "new");
  const auto grants = all<Grant>(b.pass(1, {1}));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_FALSE(b.ledger.why_unit(1, 1, b.now).empty());
  b.wait(1000, {2, 3});
  EXPECT_EQ(all<PassComplete>(b.result(grants[0])).size(), 1u);
}

}  // namespace
}  // namespace kiln

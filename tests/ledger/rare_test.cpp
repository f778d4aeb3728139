// Moments that come rarely: passes that begin again in the middle of a dispute, workers that come back to a
// job between its passes, farms of hundreds of machines.
#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

JobTraits of_ada(uint32_t quorum = 1, PoisonPolicy poison = PoisonPolicy::kFail) {
  JobTraits traits;
  traits.user = "ada";
  traits.quorum = quorum;
  traits.poison = poison;
  return traits;
}

const Error kNoMemory{ErrorKind::kInternal, "no memory"};

void begin(LedgerBench& b, JobId job, const std::vector<UnitPlan>& plan) {
  b.last.clear();
  b.ledger.begin_pass(job, plan, b.now, b.last);
  b.settle();
}

// Two answers that differ, of a unit whose pass is given up before a third decides.
LedgerBench& disputed(LedgerBench& b) {
  b.job(1, {1}, "ada", 2);
  const std::vector<Grant> first = all<Grant>(b.join(1)), second = all<Grant>(b.join(2));
  EXPECT_EQ(first.size() + second.size(), 1u);
  for (const Grant& grant : all<Grant>(b.result(first.at(0), 1))) b.result(grant, 2);
  EXPECT_EQ(b.ledger.counts(1).disputes, 1u);
  b.last.clear();
  b.ledger.abandon_pass(1, b.now, b.last);
  b.settle();
  return b;
}

TEST(Rare, ADisputeOutlivesItsPass) {
  LedgerBench b;
  disputed(b);
  b.pass(1, {1});
  EXPECT_EQ(b.ledger.counts(1).disputes, 1u);
  const std::vector<Grant> third = all<Grant>(b.join(3));
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(all<Quarantine>(b.result(third[0], 2)).size(), 1u);
  EXPECT_TRUE(b.ledger.pass_complete(1));
}

TEST(Rare, ADisputeEndsWithTheShapeOfItsUnit) {
  LedgerBench b;
  disputed(b);
  begin(b, 1, {{1, 99, 1}});
  EXPECT_EQ(b.ledger.counts(1).disputes, 0u);
  EXPECT_EQ(all<Revoke>(b.last).size(), 2u);
  EXPECT_EQ(all<Grant>(b.last).size(), 1u) << "as if nobody had answered it";
}

TEST(Rare, ALossEndsWithTheShapeOfItsUnit) {
  LedgerBench b;
  b.job(1, {1, 2}, "ada", 2);
  const Grant first = all<Grant>(b.join(1)).at(0);
  b.result(first);
  const std::vector<Grant> second = all<Grant>(b.join(2));
  ASSERT_EQ(second.at(0).unit, first.unit);
  b.lose(2);
  b.last.clear();
  b.ledger.abandon_pass(1, b.now, b.last);
  b.settle();
  begin(b, 1, {{first.unit, 99, 1}});
  b.join(3, 1, 1, "c", 2);  // the process is back
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Rare, AVerifiedResultOfAnotherShapeIsForgotten) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada());
  const std::vector<KnownAnswer> known{{1, 1, digest_of(1), "w9", true, true}};
  b.ledger.restore(1, known);
  EXPECT_EQ(b.ledger.counts(1).verified, 1u);
  begin(b, 1, {{1, 99, 1}});
  EXPECT_EQ(b.ledger.counts(1).verified, 0u);
  EXPECT_EQ(all<Revoke>(b.last).size(), 1u);
}

TEST(Rare, DamageOfAResultBeforeTheFirstPassBeginsNothingAgain) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada());
  const std::vector<KnownAnswer> known{{1, 1, digest_of(1), "w9", true, true}};
  b.ledger.restore(1, known);
  EXPECT_FALSE(b.ledger.pass_complete(1)) << "none has begun";
  b.last.clear();
  b.ledger.damaged(1, 1, b.now, b.last);
  EXPECT_EQ(all<Revoke>(b.last).size(), 1u);
  EXPECT_TRUE(all<Rewind>(b.last).empty());
  begin(b, 1, {{1, 1, 1}});
  EXPECT_TRUE(all<Deliver>(b.last).empty());
  EXPECT_EQ(all<Grant>(b.join(1)).size(), 1u);
}

TEST(Rare, AUnitMayBeGivenUpAfterItsPass) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada(1, PoisonPolicy::kSkip));
  b.pass(1, {1});
  for (WorkerId w = 1; w <= 3; ++w) {
    ASSERT_EQ(all<Grant>(b.join(w)).size(), 1u) << w;
    b.lose(w);
    if (w < 3) b.wait(1200);
  }
  b.last.clear();
  b.ledger.abandon_pass(1, b.now, b.last);
  b.settle();
  EXPECT_EQ(all<SkipUnit>(b.wait(1200)).size(), 1u);
  EXPECT_EQ(b.ledger.pass(1).failed, 0u) << "that pass has ended without it";
}

TEST(Rare, AProcessThatComesBackStillFailedWhatItFailed) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1, 1, 1, "c", 71);
  b.last.clear();
  b.ledger.unit_failed(1, 1, 1, kNoMemory, b.now, b.last);
  b.settle();
  ASSERT_EQ(b.ledger.held(1), 1u) << "there is no other machine";
  b.lose(1);
  const auto why = [&] { return ::testing::PrintToString(b.ledger.why_unit(1, 1, b.now)); };
  EXPECT_TRUE(says(why(), "it cost 2 workers")) << why();
  b.ledger.hold(true, b.now, b.last);
  b.join(2, 1, 1, "c", 71);
  EXPECT_TRUE(says(why(), "it cost 1 workers")) << why();
}

TEST(Rare, AWorkerComesBackToAJobBetweenItsPasses) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada());
  b.join(1);
  b.last.clear();
  b.ledger.ready(1, 1, "c", 2, {}, b.now, b.last);
  EXPECT_EQ(b.ledger.view(1, b.now).job, 1u);
  EXPECT_EQ(all<Grant>(b.pass(1, {1, 2})).size(), 2u) << "its scene is ready";
}

TEST(Rare, AWorkerThatLeavesOrCannotDoesNotComeBackToAJob) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada());
  b.join(1);
  b.join(2);
  b.last.clear();
  b.ledger.drain(1, {}, b.now, b.last);
  b.ledger.job_refused(2, 1, kNoMemory, b.now, b.last);
  for (const WorkerId w : {1, 2}) {
    b.ledger.ready(w, 1, "c", 2, {}, b.now, b.last);
    EXPECT_EQ(b.ledger.view(w, b.now).job, 0u) << w;
  }
  EXPECT_TRUE(all<Grant>(b.pass(1, {1, 2})).empty());
}

TEST(Rare, AWorkerIsReadyForTheJobThatItServesAlone) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.job(2, {1, 2});
  b.join(1);
  const JobId its = b.ledger.view(1, b.now).job;
  b.last.clear();
  b.ledger.ready(1, 3 - its, "c", 4, {}, b.now, b.last);
  EXPECT_TRUE(b.last.empty());
  EXPECT_EQ(b.ledger.view(1, b.now).job, its);
  EXPECT_EQ(b.ledger.view(1, b.now).credits, 1u);
}

TEST(Rare, AWorkerThatRunsOutOfMemoryDoesNotFailTheJob) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.last.clear();
  b.ledger.job_refused(1, 1, kNoMemory, b.now, b.last);
  b.settle();
  EXPECT_TRUE(all<FailJob>(b.last).empty());
  EXPECT_EQ(b.ledger.held(1), 0u);
  EXPECT_EQ(all<Grant>(b.join(2)).size(), 1u);
}

TEST(Rare, AnAnswerOfAClassThatItsWorkerHasGivenUpIsDropped) {
  LedgerBench b;
  b.job(1, {1});
  const Grant grant = all<Grant>(b.join(1)).at(0);
  b.ledger.prove(1, 1, "d");
  b.last.clear();
  b.ledger.result(1, 1, grant.unit, digest_of(1), b.now, b.last);
  EXPECT_TRUE(b.last.empty()) << "it goes on serving the job";
  EXPECT_EQ(b.ledger.view(1, b.now).job, 1u);
}

TEST(Rare, AnotherMachineOfTheSameOwnerConfirmsNothing) {
  LedgerBench b;
  b.job(1, {1});
  const auto join = [&](WorkerId w) {
    b.last.clear();
    WorkerTraits traits{"w" + std::to_string(w), "w" + std::to_string(w), 1, w};
    traits.owner = traits.voter = "eve";
    b.expect(w);
    b.ledger.join(w, traits, b.now, b.last);
    return all<Grant>(b.settle());
  };
  const Grant grant = join(1).at(0);
  join(2);
  b.ledger.prove(2, 1, "c");
  b.result(grant);
  ASSERT_TRUE(b.ledger.pass_complete(1));
  b.result({2, 1, 0, 1});
  EXPECT_EQ(b.ledger.counts(1).verified, 0u);
  EXPECT_EQ(b.ledger.counts(1).unverified, 1u);
}

TEST(Rare, OnlyAMachineThatCouldGoOnMakesAnotherABadOne) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada(1, PoisonPolicy::kSkip));
  b.pass(1, {1, 2, 3, 4, 5, 6, 7, 8, 9});
  b.join(1);
  b.join(2);
  b.join(3);
  const auto fail_all = [&](WorkerId w) {  // what it holds, and what it gets then
    for (int failures = 0; failures < 9 && b.ledger.held(w) == 1; ++failures) {
      b.last.clear();
      for (uint64_t unit = 1; unit <= 9 && b.last.empty(); ++unit)
        b.ledger.unit_failed(w, 1, unit, kNoMemory, b.now, b.last);
      b.settle();
    }
    return b.ledger.view(w, b.now).state;
  };
  EXPECT_EQ(fail_all(1), "benched") << "two others are there";
  b.last.clear();
  b.ledger.drain(3, {}, b.now, b.last);
  b.settle();
  EXPECT_NE(fail_all(2), "benched") << "one is benched itself, one leaves";
  b.last.clear();
  b.ledger.hand_back(1, 1, 1, b.now, b.last);  // it is spoken to, and gets nothing
  EXPECT_TRUE(all<Grant>(b.last).empty());
  const std::string why = ::testing::PrintToString(b.ledger.why_worker(1, b.now));
  EXPECT_TRUE(says(why, "it failed several units in a row: none for 30 s more")) << why;
}

TEST(Rare, NoCheckIsWaivedOfADispute) {
  FarmRules rules = quick_rules();
  rules.audit_first = 10;
  LedgerBench b(rules);
  b.job(1, {1});
  const Grant first = all<Grant>(b.join(1)).at(0);
  const std::vector<Grant> second = all<Grant>(b.join(2));
  EXPECT_TRUE(second.empty());
  for (const Grant& grant : all<Grant>(b.result(first, 1))) b.result(grant, 2);
  ASSERT_EQ(b.ledger.counts(1).disputes, 1u);
  b.lose(2);
  b.wait(3000, {1});
  EXPECT_EQ(b.ledger.counts(1).waived, 0u);
  EXPECT_FALSE(b.ledger.pass_complete(1));
}

TEST(Rare, AJobThatIsStuckTakesTheClassOfMostMachines) {
  FarmRules rules = quick_rules();
  rules.class_patience_ms = 300;
  LedgerBench b(rules);
  b.job(1, {1, 2});
  b.result(all<Grant>(b.join(1, 1, 1, "old")).at(0));
  b.join(2, 1, 1, "a many");
  b.join(3, 1, 1, "a many");
  b.join(4, 1, 1, "b few");
  b.lose(1);
  const auto pinned = all<PinClass>(b.wait(600, {2, 3, 4}));
  ASSERT_EQ(pinned.size(), 1u);
  EXPECT_EQ(pinned[0].numeric_class, "a many");
}

// Full searches of what others hold are limited, and messages wait for the tick.
TEST(Rare, HundredsOfIdleWorkersDoNotSearchAllTheTime) {
  LedgerBench b;
  std::vector<uint64_t> units(300);
  for (size_t i = 0; i < units.size(); ++i) units[i] = i + 1;
  b.job(1, units);
  std::vector<Grant> out;
  for (WorkerId w = 1; w <= 300; ++w)
    for (const Grant& grant : all<Grant>(b.join(w))) out.push_back(grant);
  for (const Grant& grant : all<Grant>(b.wait(100))) out.push_back(grant);
  ASSERT_EQ(out.size(), 300u);
  for (const Grant& grant : out) b.result(grant);
  b.wait(100);
  ASSERT_TRUE(b.ledger.pass_complete(1));
  b.now += 5;
  EXPECT_TRUE(all<Grant>(b.pass(1, {1001, 1002, 1003})).empty()) << "the tick was just now";
  out = all<Grant>(b.wait(100));
  ASSERT_EQ(out.size(), 3u);
  for (const Grant& grant : out) b.result(grant);
  ASSERT_TRUE(b.ledger.pass_complete(1));
  b.now += 50;
  EXPECT_EQ(all<Grant>(b.pass(1, {1001, 1002, 1003, 1004})).size(), 1u) << "it is some time ago";
}

TEST(Rare, NobodyHasNoVote) {
  const FarmRules rules;
  TrustTable trust(rules);
  EXPECT_EQ(trust.votes({}), 0u);
  EXPECT_EQ(trust.votes({trust.intern("w1")}), 1u);
}

}  // namespace
}  // namespace kiln

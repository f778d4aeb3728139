// Messages that come too late, twice, or from somebody who does not count any more; and what is said of the
// checks.
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

TEST(Late, AQuarantinedWorkersAnswersDoNotCountBeforeItsConnectionEnds) {
  LedgerBench b;
  b.job(1, {1, 2});
  const Grant grant = all<Grant>(b.join(1)).at(0);
  b.last.clear();
  b.ledger.quarantine("w1", "it lied", b.now, b.last);
  EXPECT_EQ(all<Expel>(b.last).size(), 1u);
  EXPECT_EQ(b.ledger.view(1, b.now).state, "leaving");
  b.last.clear();
  b.ledger.result(1, 1, grant.unit, digest_of(1), b.now, b.last);
  EXPECT_TRUE(b.last.empty());
  b.ledger.quarantine("w1", "it lied again", b.now, b.last);
  EXPECT_TRUE(all<Quarantine>(b.last).empty());
  EXPECT_EQ(*b.ledger.quarantined_for("w1"), "it lied") << "the first reason stays";
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Late, AnswersOfAnotherClassAreNotWaitedFor) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.join(1);
  b.join(2, 1, 1, "d");
  b.last.clear();
  b.ledger.result(2, 1, 2, digest_of(1), b.now, b.last);
  ASSERT_EQ(all<Release>(b.last).size(), 1u);
  EXPECT_EQ(all<Release>(b.last)[0].reason, "the job needs another numeric class");
}

TEST(Late, TheAnswerToAUnitThatWasGivenUpIsAcknowledgedAndForgotten) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada(1, PoisonPolicy::kSkip));
  b.pass(1, {1});
  for (WorkerId w = 1; w <= 3; ++w) b.join(w);
  std::vector<SkipUnit> skipped;
  for (int failures = 0; failures < 3; ++failures) {
    EXPECT_TRUE(skipped.empty());
    WorkerId holder = 1;
    while (holder < 3 && b.ledger.held(holder) == 0) ++holder;
    b.last.clear();
    b.ledger.unit_failed(holder, 1, 1, Error{ErrorKind::kInternal, "no memory"}, b.now, b.last);
    skipped = all<SkipUnit>(b.settle());
  }
  ASSERT_EQ(skipped.size(), 1u);
  b.last.clear();
  b.ledger.result(1, 1, 1, digest_of(1), b.now, b.last);
  EXPECT_EQ(all<Acknowledge>(b.last).size(), 1u);
  EXPECT_TRUE(all<StoreAnswer>(b.last).empty());
}

TEST(Late, SixDifferentAnswersAreTheJobsFault) {
  LedgerBench b;
  b.job(1, {1}, "ada", 2);
  std::vector<FailJob> failed;
  for (WorkerId w = 1; w <= 6; ++w) {
    EXPECT_TRUE(failed.empty()) << w;
    const std::vector<Grant> grants = all<Grant>(b.join(w));
    ASSERT_EQ(grants.size(), 1u) << w;
    failed = all<FailJob>(b.result(grants[0], static_cast<int>(w)));
  }
  ASSERT_FALSE(failed.empty());
  EXPECT_TRUE(says(failed[0].error.message, "unit 1 was answered by 6 workers"));
}

TEST(Late, AnInputThatNoWorkerCanUseFailsTheJobAtOnce) {
  for (const ErrorKind kind : {ErrorKind::kInvalidInput, ErrorKind::kUsage}) {
    LedgerBench b;
    b.job(1, {1, 2});
    const Grant grant = all<Grant>(b.join(1)).at(0);
    b.last.clear();
    b.ledger.unit_failed(1, 1, grant.unit, Error{kind, "the tile is empty"}, b.now, b.last);
    ASSERT_EQ(all<FailJob>(b.last).size(), 1u);
    EXPECT_TRUE(says(all<FailJob>(b.last)[0].error.message, "the tile is empty"));
  }
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.last.clear();
  b.ledger.job_refused(1, 1, Error{ErrorKind::kInvalidInput, "no such material"}, b.now, b.last);
  EXPECT_EQ(all<FailJob>(b.last).size(), 1u);
}

TEST(Late, AWorkerMayRefuseAJobThatItDoesNotServe) {
  LedgerBench b;
  b.job(1, {1});
  b.job(2, {1});
  b.join(1);
  const JobId other = b.ledger.view(1, b.now).job == 1 ? 2 : 1;
  b.last.clear();
  b.ledger.job_refused(1, other, Error{ErrorKind::kInvalidInput, "too large"}, b.now, b.last);
  EXPECT_TRUE(b.ledger.is_banned(1, other));
  EXPECT_TRUE(all<FailJob>(b.last).empty()) << "it has not read the job's input";
  EXPECT_EQ(b.ledger.held(1), 1u) << "and goes on with the job that it serves";
}

TEST(Late, AnAbandonedPassLeavesNothingBehind) {
  LedgerBench b;
  b.job(1, {1, 2, 3});
  b.join(1);
  b.last.clear();
  b.ledger.abandon_pass(1, b.now, b.last);
  b.settle();
  EXPECT_EQ(all<Recall>(b.last).size(), 1u);
  EXPECT_TRUE(b.ledger.pass_complete(1));
  EXPECT_EQ(b.ledger.held(1), 0u);
  b.last.clear();
  b.ledger.abandon_pass(1, b.now, b.last);
  b.ledger.abandon_pass(7, b.now, b.last);
  EXPECT_TRUE(b.last.empty());
  EXPECT_FALSE(b.ledger.pass_complete(7));
  EXPECT_EQ(b.ledger.user(7), "");
  EXPECT_EQ(b.ledger.numeric_class(7), "");
}

TEST(Late, AJobIsStuckWhileNoWorkerOfItsClassIsThere) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.result(all<Grant>(b.join(1)).at(0));
  EXPECT_EQ(b.ledger.stuck_ms(1, b.now), -1);
  b.lose(1);
  b.join(2, 1, 1, "d");
  b.wait(2000, {2});
  EXPECT_GT(b.ledger.stuck_ms(1, b.now), 0);
  EXPECT_LE(b.ledger.stuck_ms(1, b.now), 2000);
}

TEST(Late, AFarmOfManyWorkersIsServedByTheTick) {
  LedgerBench b;
  for (WorkerId w = 1; w <= 300; ++w) b.join(w);
  std::vector<uint64_t> units(600);
  for (size_t i = 0; i < units.size(); ++i) units[i] = i + 1;
  b.wait(100);
  b.job(1, units);
  b.job(2, {1});
  b.wait(100);
  size_t held = 0;
  for (WorkerId w = 1; w <= 300; ++w) held += b.ledger.held(w);
  EXPECT_EQ(held, 300u) << "every worker has a unit";
}

TEST(Late, AProcessThatComesBackTakesBackNoFailureOfAnother) {
  LedgerBench b;
  b.job(1, {1}, "ada", 2);
  b.join(1);
  b.join(2);
  b.last.clear();
  b.ledger.unit_failed(1, 1, 1, Error{ErrorKind::kInternal, "no memory"}, b.now, b.last);
  const std::vector<Grant> first = all<Grant>(b.settle());
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(first[0].worker, 2u);
  b.lose(1);
  b.result(first[0]);
  ASSERT_EQ(all<Grant>(b.join(3, 1, 1, "c", 77)).size(), 1u) << "to confirm it";
  b.lose(3);  // of a unit that has been answered: it is not to blame
  b.ledger.hold(true, b.now, b.last);
  b.join(4, 1, 1, "c", 77);
  b.last.clear();
  b.ledger.quarantine("w2", "it lied", b.now, b.last);
  const std::string why = ::testing::PrintToString(b.ledger.why_unit(1, 1, b.now));
  EXPECT_TRUE(says(why, "it cost 1 workers")) << why;
  EXPECT_TRUE(says(why, "w1 failed it")) << why;
}

TEST(Late, ABenchedWorkersFailuresAreForgottenInTheJobsInWhichItFailed) {
  LedgerBench b;
  const auto join = [&](WorkerId id) {  // processes of one machine
    b.last.clear();
    b.expect(id);
    b.ledger.join(id, {"w", "w", 1, id}, b.now, b.last);
    return all<Grant>(b.settle());
  };
  const auto fail = [&](JobId job, uint64_t unit) {
    b.last.clear();
    b.ledger.unit_failed(3, job, unit, Error{ErrorKind::kInternal, "no memory"}, b.now, b.last);
    return all<Grant>(b.settle());
  };
  const auto failed = [&](JobId job, uint64_t unit) {
    return says(::testing::PrintToString(b.ledger.why_unit(job, unit, b.now)), "w failed it");
  };
  b.job(2, {2, 5, 6});
  ASSERT_EQ(join(1).at(0).unit, 2u);
  b.lose(1);
  b.wait(1200);  // it does not come back: unit 2 of job 2 is to blame
  b.ledger.change_job(2, 0, true, b.now, b.last);
  b.job(1, {1, 2, 3, 4});
  ASSERT_EQ(all<Grant>(b.join(9)).at(0).unit, 1u);
  ASSERT_EQ(join(3).at(0).unit, 2u);
  ASSERT_EQ(fail(1, 2).at(0).unit, 3u);
  ASSERT_EQ(fail(1, 3).at(0).unit, 4u);
  b.ledger.change_job(1, 0, true, b.now, b.last);
  b.ledger.change_job(2, 0, false, b.now, b.last);
  b.last.clear();
  b.ledger.hand_back(3, 1, 4, b.now, b.last);
  ASSERT_EQ(all<Grant>(b.settle()).at(0).unit, 5u);
  EXPECT_TRUE(failed(1, 2) && failed(1, 3) && failed(2, 2));
  fail(2, 5);
  ASSERT_EQ(b.ledger.view(3, b.now).state, "benched");
  EXPECT_FALSE(failed(1, 2) || failed(1, 3) || failed(2, 5));
  EXPECT_TRUE(failed(2, 2)) << "in which a process of the machine died";
}

TEST(Late, ASingleMachineIsNotBenched) {
  LedgerBench b;
  b.ledger.add_job(1, of_ada(1, PoisonPolicy::kSkip));
  b.pass(1, {1, 2, 3, 4, 5});
  b.join(1);
  for (int failures = 0; failures < 15 && b.ledger.held(1) == 1; ++failures) {
    b.last.clear();
    for (uint64_t unit = 1; unit <= 5 && b.last.empty(); ++unit)  // the one that it holds
      b.ledger.unit_failed(1, 1, unit, Error{ErrorKind::kInternal, "no memory"}, b.now, b.last);
    b.settle();
  }
  EXPECT_EQ(b.ledger.pass(1).failed, 5u) << "each was tried as often as a unit is";
  EXPECT_EQ(b.ledger.view(1, b.now).state, "idle");
}

TEST(Views, SayWhatAWorkerDoes) {
  LedgerBench b;
  EXPECT_EQ(b.ledger.view(9, b.now).state, "") << "nobody";
  b.join(1);
  EXPECT_EQ(b.ledger.view(1, b.now).state, "idle");
  b.ledger.add_job(1, of_ada());
  b.last.clear();
  const std::vector<UnitPlan> plan{{1, 1, 1}};
  b.ledger.begin_pass(1, plan, b.now, b.last);
  ASSERT_EQ(all<Assign>(b.last).size(), 1u);
  EXPECT_EQ(b.ledger.view(1, b.now).state, "preparing");
  b.settle();
  EXPECT_EQ(b.ledger.view(1, b.now).state, "baking");
}

TEST(Verification, NamesTheSixWhoWereCheckedLeast) {
  Verification v;
  EXPECT_EQ(verification_text(v), "") << "no results";
  EXPECT_EQ(unseen_probability(v, 0.5, 3), 1);
  v.unverified = 70;
  v.trusted = true;
  EXPECT_EQ(verification_text(v), "none of 70 unit results was checked: machines are trusted here");
  v.verified = 30;
  EXPECT_TRUE(says(verification_text(v), "30 of 100 unit results were confirmed"))
      << "some were, all the same";
  v.trusted = false;
  v.quorum = 2;
  for (uint64_t i = 0; i < 7; ++i) v.by.push_back({"machine" + std::to_string(i), 10, 10 + i, i});
  const std::string said = verification_text(v);
  EXPECT_TRUE(says(said, "30 of 100 unit results were confirmed by another machine"));
  EXPECT_TRUE(says(said, "a quorum of 2 machines was asked for"));
  EXPECT_TRUE(says(said, "owners are not told apart here"));
  EXPECT_TRUE(says(said, ". machine6 gave 10 (16 alone) and confirmed 6; machine5 gave"));
  EXPECT_TRUE(says(said, "; and 1 others"));
  EXPECT_FALSE(says(said, "machine0"));
  v.owners_known = true;
  EXPECT_TRUE(says(verification_text(v), "by another owner"));
  EXPECT_FALSE(says(verification_text(v), "told apart"));
}

}  // namespace
}  // namespace kiln

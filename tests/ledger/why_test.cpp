// `why`: the sentence that names the rule which decides.
#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

bool says(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines)
    if (line.find(words) != std::string::npos) return true;
  return false;
}

#define EXPECT_SAYS(lines, words) EXPECT_TRUE(says(lines, words)) << ::testing::PrintToString(lines)

TEST(Why, AJobThatIsNotBakedOrNotBegunOrPausedSaysSo) {
  LedgerBench b;
  EXPECT_SAYS(b.ledger.why_job(1, 0), "job 1 is not being baked");
  JobTraits traits;
  traits.user = "ada";
  traits.quorum = 2;
  b.ledger.add_job(1, traits);
  EXPECT_SAYS(b.ledger.why_job(1, 0), "its scene is being prepared");
  EXPECT_SAYS(b.ledger.why_job(1, 0), "no worker is present that could");
  EXPECT_SAYS(b.ledger.why_job(1, 0), "the job waits for others");
  b.ledger.change_job(1, 0, true, 0, b.last);
  EXPECT_SAYS(b.ledger.why_job(1, 0), "it is paused");
  b.ledger.hold(true, 0, b.last);
  EXPECT_SAYS(b.ledger.why_job(1, 0), "the store cannot write");
}

TEST(Why, AJobNamesItsPassItsDisputesAndWhoCannotServeIt) {
  FarmRules rules = quick_rules();
  rules.owners_known = true;
  LedgerBench b(rules);
  b.job(1, {1, 2}, "ada", 2);
  const auto first = all<Grant>(b.join(1));
  const auto second = all<Grant>(b.join(2));
  b.join(3, 1, 1, "other");
  b.result(first.at(0), 1);
  const auto lines = b.ledger.why_job(1, b.now);
  EXPECT_SAYS(lines, "pass 1: 0 of 2 units done");
  EXPECT_SAYS(lines, "w3 cannot serve it: numeric class other differs");
  EXPECT_SAYS(lines, "by 2 different owners; 3 are here");
  EXPECT_SAYS(lines, "2 workers are present and able");
  for (const Grant& g : all<Grant>(b.last))
    if (g.unit == first[0].unit) b.result(g, 2);
  b.result(second.at(0), 3);
  for (const Grant& g : all<Grant>(b.last)) b.result(g, 4);
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "units have answers that differ");
}

TEST(Why, AJobBetweenPassesAndAfterChecksSaysHowFarItWasChecked) {
  LedgerBench b;
  b.job(1, {1});
  b.result(all<Grant>(b.join(1)).at(0));
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "merging and planning the next pass");
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "machines are trusted here");
}

TEST(Why, AJobWhoseWorkersServeOthersNamesTheOther) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4}, "ada", 1, 10);
  b.join(1, 1, 2);
  b.job(2, {1}, "ada", 1, 0);
  b.job(3, {1}, "ben", 1, -100);
  EXPECT_SAYS(b.ledger.why_job(2, b.now), "job 1 of the same user is served first: priority 10");
  EXPECT_SAYS(b.ledger.why_job(3, b.now), "job 1 of ada is served: that user's virtual time");
  EXPECT_SAYS(b.ledger.why_job(3, b.now), "1 of them serve other jobs");
  b.wait(1200);
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "1 are silent");
}

TEST(Why, AUnitSaysWhereItIs) {
  FarmRules rules = quick_rules();
  rules.audit_first = 5;
  LedgerBench b(rules);
  EXPECT_SAYS(b.ledger.why_unit(1, 1, 0), "job 1 is not being baked");
  b.job(1, {1, 2, 3});
  EXPECT_SAYS(b.ledger.why_unit(1, 9, 0), "job 1 has no unit 9 so far");
  EXPECT_SAYS(b.ledger.why_unit(1, 3, 0), "it waits: 2 units are before it");
  b.disk = false;
  const auto grants = all<Grant>(b.join(1, 2, 2));
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now + 300), "w1 has had it for 0.3 s");
  const Actions out = b.result(grants.at(0), 7);
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "2 equal answers of different machines are needed");
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "(not on disk yet)");
  b.last.clear();
  b.ledger.stored(1, 1, all<StoreAnswer>(out).at(0).ticket, b.now, b.last);
  EXPECT_FALSE(says(b.ledger.why_unit(1, 1, b.now), "(not on disk yet)"));
  b.disk = true;
  for (const Grant& g : all<Grant>(b.join(2)))
    if (g.unit == 1) b.result(g, 7);
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "unit 1 has its result");
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "by w1, w2: 2 of different machines");
}

TEST(Why, ASuspectAndAFailedUnitNameWhomTheyCost) {
  LedgerBench b;
  b.job(1, {1});
  b.join(1);
  b.lose(1);
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "it cost 1 workers and runs alone");
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "w1 failed it");
  for (WorkerId w = 2; w <= 3; ++w) {
    b.join(w);
    b.lose(w);
    b.wait(1200);
  }
  EXPECT_SAYS(b.ledger.why_unit(1, 1, b.now), "unit 1 failed");
}

TEST(Why, AWorkerSaysWhyItGetsNothing) {
  FarmRules rules = quick_rules();
  rules.audit_first = 2;
  LedgerBench b(rules);
  EXPECT_SAYS(b.ledger.why_worker(1, 0), "worker 1 is not connected");
  b.join(1);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "it has no job");
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "until 2 did, all are verified");
  JobTraits traits;
  traits.user = "ada";
  b.ledger.add_job(1, traits);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "job 1: between passes or being prepared");
  b.ledger.change_job(1, 0, true, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "job 1: paused");
  b.ledger.change_job(1, 0, false, b.now, b.last);
  b.ledger.job_refused(1, 1, Error{ErrorKind::kInternal, "no memory"}, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "job 1: no memory");
  b.join(2);
  b.pass(1, {1});
  b.join(3);
  EXPECT_SAYS(b.ledger.why_worker(3, b.now), "nothing left to hand out, 1 units with workers");
  b.ledger.hold(true, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(2, b.now), "the store cannot write");
  EXPECT_SAYS(b.ledger.why_worker(2, b.now), "it serves job 1 of ada");
  EXPECT_SAYS(b.ledger.why_worker(2, b.now), "it holds 1 of 1 units");
  b.ledger.hold(false, b.now, b.last);
  b.last.clear();
  b.ledger.drain(2, {}, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(2, b.now), "it is draining");
  b.wait(1200);
  EXPECT_SAYS(b.ledger.why_worker(3, b.now), "silent for more than 1000 ms");
  EXPECT_EQ(b.ledger.view(3, b.now).state, "silent");
  b.last.clear();
  b.ledger.quarantine("w3", "it lied", b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(3, b.now), "quarantined: it lied");
  ASSERT_NE(b.ledger.quarantined_for("w3"), nullptr);
  b.ledger.forgive("w3");
  EXPECT_EQ(b.ledger.quarantined_for("w3"), nullptr);
}

TEST(Why, ATrustedWorkersShareOfChecksIsNamed) {
  FarmRules rules = quick_rules();
  rules.audit_first = 2;
  LedgerBench b(rules);
  b.ledger.restore_trust("w1", 50, "");
  b.join(1);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "2.0 % are verified");
}

TEST(Why, AQuorumCountsWhoIsThereAndNotWhoLeaves) {
  LedgerBench b;
  b.job(1, {1, 2}, "ada", 2);
  b.join(1);
  b.join(2);
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "2 are here");
  b.last.clear();
  b.ledger.drain(2, {}, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "1 are here: the job waits for others");
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "1 workers are present and able, 0 of them serve other jobs");
}

TEST(Why, AJobThatIsServedByFewerThanItCouldBeIsNotSaidToWait) {
  LedgerBench b;
  b.job(1, {1, 2, 3});
  b.job(2, {1, 2, 3}, "ben");
  b.join(1);
  b.join(2);
  JobTraits traits;
  traits.user = "cid";
  b.ledger.add_job(3, traits);
  ASSERT_EQ(b.ledger.counts(1).workers, 1u);
  EXPECT_SAYS(b.ledger.why_job(1, b.now), "2 workers are present and able, 1 of them serve other jobs");
  EXPECT_FALSE(says(b.ledger.why_job(1, b.now), "is served"));
  EXPECT_SAYS(b.ledger.why_job(3, b.now), "job 1 of ada is served");
  EXPECT_SAYS(b.ledger.why_job(3, b.now), "job 2 of ben is served");
}

TEST(Why, AWorkerThatMakesItsSceneReadyOrLeavesForAnotherUserSaysSo) {
  LedgerBench b;
  b.job(1, {1, 2, 3});
  b.last.clear();
  b.ledger.join(1, {"w1", "w1", 1, 1}, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "it serves job 1 of ada, making its scene ready");
  b.ledger.ready(1, 1, "c", 2, {}, b.now, b.last);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "it holds 2 of 2 units");
  b.wait(5000, {1});
  b.job(2, {1}, "ben");
  b.wait(600, {1});
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), ", and leaves for another user when its units are done");
}

TEST(Why, ASilentWorkerIsNotSaidToBeTooSlow) {
  LedgerBench b;
  b.job(1, {1, 2, 3, 4});
  Grant grant = all<Grant>(b.join(1)).at(0);
  b.now += 10;
  b.result(grant);
  b.wait(1200);
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "silent for more than 1000 ms");
  EXPECT_FALSE(says(b.ledger.why_worker(1, b.now), "at its speed"));
}

TEST(Why, AWorkerThatWouldEndLateAndOneThatLeavesSaySo) {
  LedgerBench b;
  std::vector<uint64_t> units;
  for (uint64_t u = 1; u <= 12; ++u) units.push_back(u);
  b.job(1, units);
  const auto slow = all<Grant>(b.join(1));
  auto fast = all<Grant>(b.join(2));
  for (int i = 0; i < 9; ++i) {
    b.now += 10;
    fast = all<Grant>(b.result(fast.at(0)));
  }
  b.now += 300;
  b.result(slow.at(0));
  EXPECT_SAYS(b.ledger.why_worker(1, b.now), "it would end the pass later than the others");
}

}  // namespace
}  // namespace kiln

// How many must agree, and what becomes of those who do not.
#include "common/base/format.h"
#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

FarmRules audited(uint32_t first) {
  FarmRules rules = quick_rules();
  rules.audit_first = first;
  rules.audit_least = 0;
  return rules;
}

TEST(Trust, AQuorumOfTwoNeedsTwoDifferentWorkers) {
  LedgerBench b;
  b.job(1, {1}, "ada", 2);
  const auto first = all<Grant>(b.join(1));
  EXPECT_TRUE(all<Deliver>(b.result(first.at(0))).empty());
  EXPECT_TRUE(all<Grant>(b.wait(3000, {1})).empty());  // never the same one twice
  const auto second = all<Grant>(b.join(2));
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(all<Deliver>(b.result(second[0])).size(), 1u);
  EXPECT_EQ(b.ledger.counts(1).verified, 1u);
}

TEST(Trust, ANewWorkersFirstUnitsRunTwiceAndLaterOnesDoNot) {
  LedgerBench b(audited(3));
  std::vector<uint64_t> units;
  for (uint64_t u = 1; u <= 40; ++u) units.push_back(u);
  b.job(1, units);
  std::vector<Grant> open = all<Grant>(b.join(1));
  for (const Grant& g : all<Grant>(b.join(2))) open.push_back(g);
  uint64_t answers = 0;
  while (!open.empty()) {
    const Grant g = open.front();
    open.erase(open.begin());
    ++answers;
    for (const Grant& next : all<Grant>(b.result(g))) open.push_back(next);
  }
  EXPECT_TRUE(b.ledger.pass_complete(1));
  // After three agreed answers each unit is asked twice with probability 1 / agreed.
  EXPECT_GE(answers, 43u);
  EXPECT_LE(answers, 65u);
}

TEST(Trust, AThirdWorkerDecidesAndTheLoserIsQuarantinedWithAllThatItAloneSaid) {
  LedgerBench b(audited(1));
  b.ledger.restore_trust("w1", 1000000000, "");  // trusted: not asked twice
  b.job(1, {1, 2});
  auto liar = all<Grant>(b.join(1));
  liar = all<Grant>(b.result(liar.at(0), 66));  // unit 1, wrong and alone
  ASSERT_EQ(b.ledger.pass(1).done, 1u);
  b.join(2);  // copies nothing yet: unit 2 is with the liar
  b.last.clear();
  b.ledger.hold(false, b.now, b.last);
  // Worker 2 answers unit 2 first by a copy, and the liar differs.
  const auto copy = all<Grant>(b.wait(4000, {1, 2}));
  ASSERT_EQ(copy.size(), 1u);
  b.result(copy[0], 1);
  const auto disputed = b.result(liar.at(0), 66);
  EXPECT_TRUE(all<Deliver>(disputed).empty());
  EXPECT_EQ(b.ledger.counts(1).disputes, 1u);
  auto third = all<Grant>(b.join(3));
  ASSERT_FALSE(third.empty());
  const Actions decided = b.result(third[0], 1);
  const auto quarantined = all<Quarantine>(decided);
  ASSERT_EQ(quarantined.size(), 1u);
  EXPECT_EQ(quarantined[0].identity, "w1");
  EXPECT_EQ(all<Rewind>(decided).size(), 1u);  // unit 1 had been merged
  EXPECT_GE(all<Revoke>(decided).size(), 1u);
  EXPECT_TRUE(b.ledger.quarantined_for("w1"));
  EXPECT_EQ(all<Expel>(b.join(4)).size(), 0u);
  b.last.clear();
  b.ledger.join(5, {"w1", "again", 1, 55}, b.now, b.last);
  EXPECT_EQ(all<Expel>(b.last).size(), 1u);
}

TEST(Trust, WhoContradictsItselfIsQuarantined) {
  LedgerBench b;
  b.job(1, {1}, "ada", 2);
  const auto first = all<Grant>(b.join(1));
  b.result(first.at(0), 5);
  EXPECT_EQ(all<Quarantine>(b.result(first.at(0), 6)).size(), 1u);
}

TEST(Trust, OneMachineAloneGoesOnUnverifiedButAQuorumWaits) {
  LedgerBench b(audited(10));
  b.job(1, {1});
  b.result(all<Grant>(b.join(1)).at(0));
  EXPECT_FALSE(b.ledger.pass_complete(1));
  b.wait(1500, {1});
  EXPECT_TRUE(b.ledger.pass_complete(1));
  EXPECT_EQ(b.ledger.counts(1).waived, 1u);
  LedgerBench strict(audited(10));
  strict.job(1, {1}, "ada", 2);
  strict.result(all<Grant>(strict.join(1)).at(0));
  strict.wait(5000, {1});
  EXPECT_FALSE(strict.ledger.pass_complete(1));
}

TEST(Trust, TheFirstClassIsTheJobsUntilItsMachinesAreGone) {
  LedgerBench b;
  b.job(1, {1, 2});
  const auto odd = all<Grant>(b.join(1, 1, 1, "odd"));
  ASSERT_EQ(odd.size(), 1u);
  b.result(odd[0]);
  EXPECT_TRUE(all<Grant>(b.join(2, 1, 1, "common")).empty());
  EXPECT_TRUE(all<Grant>(b.join(3, 1, 1, "common")).empty());
  b.lose(1);
  EXPECT_TRUE(all<Grant>(b.wait(4000, {2, 3})).empty());
  const Actions later = b.wait(2000, {2, 3});
  ASSERT_EQ(all<PinClass>(later).size(), 1u);
  EXPECT_EQ(all<PinClass>(later)[0].numeric_class, "common");
  EXPECT_EQ(all<Revoke>(later).size(), 1u);  // results of two classes are never mixed
  EXPECT_EQ(all<Rewind>(later).size(), 1u);
  EXPECT_EQ(all<Grant>(b.pass(1, {1, 2})).size(), 2u);
}

TEST(Trust, AfterAChangeOfClassTheOldOnesWorkersGetNothing) {
  LedgerBench b;
  b.job(1, {1, 2}, "ada", 2);  // one machine of a class cannot decide alone
  for (const Grant& g : all<Grant>(b.join(1, 2, 2, "odd"))) b.result(g);
  b.join(2, 1, 1, "common");
  b.join(3, 1, 1, "common");
  const Actions later = b.wait(6000, {1, 2, 3});
  ASSERT_EQ(all<PinClass>(later).size(), 1u);
  for (const Grant& g : all<Grant>(b.pass(1, {1, 2}))) EXPECT_NE(g.worker, 1u);
  EXPECT_TRUE(b.ledger.is_banned(1, 1));
  EXPECT_EQ(b.ledger.held(2), 1u);
}

// The farm has the units of the present pass alone.
TEST(Trust, ARewindRecallsWhatIsOutAndBeginsWithTheFirstPass) {
  LedgerBench b;
  b.job(1, {1, 2});
  for (const Grant& g : all<Grant>(b.join(1, 2, 2))) b.result(g);
  ASSERT_TRUE(b.ledger.pass_complete(1));
  const auto out = all<Grant>(b.pass(1, {3, 4}));
  ASSERT_EQ(out.size(), 2u);
  b.last.clear();
  b.ledger.damaged(1, 1, b.now, b.last);
  EXPECT_EQ(all<Rewind>(b.last).size(), 1u);
  EXPECT_EQ(all<Recall>(b.last).size(), 2u);
  EXPECT_EQ(b.ledger.held(1), 0u);
  const auto again = all<Grant>(b.pass(1, {1, 2}));
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].unit, 1u);
  b.result(again[0]);
  EXPECT_EQ(all<Grant>(b.pass(1, {3, 4})).size(), 2u);
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Trust, ALateDisputeOfAnEarlierPassIsDecidedWhenThatPassComesAgain) {
  LedgerBench b;
  b.job(1, {1, 2});
  const auto first = all<Grant>(b.join(1, 2, 2));
  ASSERT_EQ(first.size(), 2u);
  const Grant late{2, 1, 0, 1};  // what another process was given and brings when its pass is over
  b.join(2);
  for (const Grant& g : first) b.result(g);
  ASSERT_EQ(all<Grant>(b.pass(1, {3, 4, 5})).back().worker, 2u);  // it has proven its class
  const Actions disputed = b.result(late, 66);
  EXPECT_EQ(all<Rewind>(disputed).size(), 1u);
  EXPECT_EQ(b.ledger.counts(1).disputes, 0u);
  EXPECT_TRUE(all<Grant>(disputed).empty());
  b.join(3);
  const auto third = all<Grant>(b.pass(1, {1, 2}));
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(third[0].unit, 1u);
  EXPECT_EQ(third[0].worker, 3u);
  EXPECT_EQ(all<Quarantine>(b.result(third[0], 1)).size(), 1u);
  EXPECT_TRUE(b.ledger.pass_complete(1));
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Trust, AUnitThatIsHandedBackIsGivenAnewAndNobodyIsBlamed) {
  LedgerBench b;
  b.job(1, {1});
  ASSERT_EQ(all<Grant>(b.join(1)).size(), 1u);
  b.last.clear();
  b.ledger.hand_back(1, 1, 1, b.now, b.last);
  const auto again = all<Grant>(b.last);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].worker, 1u);
  b.result(again[0]);
  EXPECT_TRUE(b.ledger.pass_complete(1));
  EXPECT_EQ(b.ledger.audit(), "");
}

TEST(Trust, TwoMachinesOfOneOwnerDoNotOutvoteAnother) {
  LedgerBench b(audited(1000));
  b.job(1, {1});
  const auto join = [&](WorkerId w, const std::string& owner) {
    b.last.clear();
    WorkerTraits traits{text("w{}", w), text("w{}", w), 1, w};
    traits.owner = traits.voter = owner;
    b.expect(w);
    b.ledger.join(w, traits, b.now, b.last);
    return all<Grant>(b.settle());
  };
  const auto first = join(1, "eve");
  ASSERT_EQ(first.size(), 1u);
  EXPECT_TRUE(all<Deliver>(b.result(first[0], 66)).empty());
  EXPECT_TRUE(join(2, "eve").empty()) << "the same owner is not asked to confirm";
  b.ledger.prove(2, 1, "c");
  b.result({2, 1, 0, 1}, 66);  // it answers all the same
  EXPECT_FALSE(b.ledger.pass_complete(1));
  const auto honest = join(3, "ada");
  ASSERT_EQ(honest.size(), 1u);
  EXPECT_TRUE(all<Quarantine>(b.result(honest[0], 1)).empty()) << "one owner stands against one";
  EXPECT_FALSE(b.ledger.pass_complete(1));
  const auto third = join(4, "bob");
  ASSERT_EQ(third.size(), 1u);
  const Actions decided = b.result(third[0], 1);
  EXPECT_EQ(all<Quarantine>(decided).size(), 2u);
  EXPECT_TRUE(b.ledger.quarantined_for("w1"));
  EXPECT_TRUE(b.ledger.quarantined_for("w2"));
  EXPECT_TRUE(b.ledger.pass_complete(1));
  const Verification v = b.ledger.verification(1);
  EXPECT_EQ(v.verified, 1u);
  EXPECT_EQ(v.by, (std::vector<Contribution>{{"w3", 1, 0, 0}, {"w4", 0, 0, 1}}));
}

// After a restart an answer's process is known, not whose it was: it may be anybody's.
TEST(Trust, AVoteWhoseOwnerIsUnknownCountsOnlyWhereThereIsNoOther) {
  LedgerBench b(audited(1000));
  JobTraits traits;
  traits.user = "ada";
  traits.numeric_class = "c";
  b.ledger.add_job(1, traits);
  const std::vector<KnownAnswer> known = {{1, 1, digest_of(1), "w7", false, false, false}};
  b.ledger.restore(1, known);
  b.pass(1, {1});
  const auto second = all<Grant>(b.join(1));
  ASSERT_EQ(second.size(), 1u);
  EXPECT_TRUE(all<Deliver>(b.result(second[0], 1)).empty()) << "w7 may be of the same owner";
  const auto third = all<Grant>(b.join(2));
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(all<Deliver>(b.result(third[0], 1)).size(), 1u);
  // Its worker comes back and is somebody else: then two are enough.
  LedgerBench c(audited(1000));
  c.ledger.add_job(1, traits);
  c.ledger.restore(1, known);
  c.pass(1, {1});
  c.join(7);
  const auto other = all<Grant>(c.join(1));
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(all<Deliver>(c.result(other[0], 1)).size(), 1u);
}

TEST(Trust, WhatACheckProvesFollowsFromItsShare) {
  Verification v;
  v.verified = 250, v.unverified = 750;
  EXPECT_DOUBLE_EQ(unseen_probability(v, 0, 1), 0.75);
  EXPECT_DOUBLE_EQ(unseen_probability(v, 0.2, 1), 0.8);
  EXPECT_DOUBLE_EQ(unseen_probability(v, 0.2, 2), 0.64);
  v.unverified = 0;
  EXPECT_DOUBLE_EQ(unseen_probability(v, 0, 1), 0);
  EXPECT_DOUBLE_EQ(unseen_probability(v, 0.5, 2), 0.25);  // accomplices confirm
  EXPECT_EQ(verification_text({}), "");
  v.owners_known = true;
  EXPECT_EQ(verification_text(v).find("machine"), std::string::npos) << verification_text(v);
}

// Its conductor could not merge it: whoever wins, it must be delivered again.
TEST(Trust, DamageOfAResultThatIsInDisputeBeginsThePassAgain) {
  LedgerBench b;
  b.job(1, {1, 2});
  const auto first = all<Grant>(b.join(1, 2, 2));
  ASSERT_EQ(first.size(), 2u);
  b.join(2);
  b.ledger.prove(2, 1, "c");
  ASSERT_EQ(all<Deliver>(b.result(first[0])).size(), 1u);
  b.result({2, 1, 0, 1}, 66);
  ASSERT_EQ(b.ledger.counts(1).disputes, 1u);
  b.last.clear();
  b.ledger.damaged(1, 1, b.now, b.last);
  EXPECT_EQ(all<Rewind>(b.last).size(), 1u);
  EXPECT_EQ(b.ledger.audit(), "");
  b.pass(1, {1, 2});
  const auto third = all<Grant>(b.join(3));
  ASSERT_FALSE(third.empty());
  EXPECT_EQ(third[0].unit, 1u);
  EXPECT_EQ(all<Deliver>(b.result(third[0], 1)).size(), 1u);
}

TEST(Trust, DamageOnDiskIsBakedAgain) {
  LedgerBench b;
  b.job(1, {1, 2});
  b.result(all<Grant>(b.join(1)).at(0));
  b.last.clear();
  b.ledger.damaged(1, 1, b.now, b.last);
  EXPECT_EQ(all<Rewind>(b.last).size(), 1u);
  EXPECT_EQ(all<Revoke>(b.last).size(), 1u);
  EXPECT_EQ(b.ledger.audit(), "");
}

}  // namespace
}  // namespace kiln

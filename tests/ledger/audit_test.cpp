// Each table's audit finds what breaks the table's invariant: here by verbs of the tables in an order that
// the ledger never uses.
#include "tests/ledger/bench.h"

namespace kiln {
namespace {

using namespace test;

struct Tables {
  FarmRules rules = quick_rules();
  TrustTable trust{rules};
  UnitTable units{rules, trust};
  WorkerTable workers{units};
  Grants grants{rules, units, workers, trust};
  UserId ada = workers.share().intern("ada");

  Tables() {
    add_job(1);
    units.open_pass(1);
  }
  void add_job(JobId id) {
    JobTraits traits;
    traits.user = "ada";
    units.add_job(id, traits, ada);
    grants.add_job(id);
  }
  UnitTable::Ref place(uint64_t id) {
    const UnitTable::Ref unit = units.find_or_add(1, id);
    units.place(unit, {id, id, 1});
    return unit;
  }
  UnitTable::Ref queue(uint64_t id) {
    const UnitTable::Ref unit = place(id);
    units.enqueue(unit);
    return unit;
  }
  WorkerTable::Ref idle(WorkerId id) {
    const std::string name = "w" + std::to_string(id);
    return workers.add(id, {name, name, 1, id}, trust.intern(name), 0);
  }
  WorkerTable::Ref ready(WorkerId id) {
    const WorkerTable::Ref worker = idle(id);
    workers.assign(worker, 1, 0);
    workers.make_ready(worker, 4, 0);
    return worker;
  }
  void answer(const UnitTable::Ref& unit, int digest, const std::string& who) {
    const size_t index = units.add_answer(unit, digest_of(digest));
    units.add_vote(unit, index, trust.intern(who));
    Digest stored;
    std::vector<WorkerId> waiting;
    EXPECT_TRUE(units.commit(unit, unit->answers[index].ticket, stored, waiting));
  }
};

TEST(Audit, TablesThatNothingHappenedToAreWhole) {
  Tables t;
  t.queue(1);
  t.idle(1);
  t.grants.add(t.queue(2), t.ready(2), 0);
  t.units.dequeue(t.units.find(1, 2));
  EXPECT_EQ(t.units.audit(), "");
  EXPECT_EQ(t.workers.audit(), "");
  EXPECT_EQ(t.grants.audit(), "");
  EXPECT_EQ(t.trust.audit(), "");
}

TEST(Audit, AUnitHasNoMoreLeasesThanItNeedsVotes) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  for (WorkerId w = 1; w <= 3; ++w) t.grants.add(unit, t.ready(w), 0);
  EXPECT_EQ(t.units.audit(), "unit 1 has 3 leases");
  t.units.require(unit, 3);
  EXPECT_EQ(t.units.audit(), "");
}

TEST(Audit, ASettledUnitHasOneAnswer) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  t.answer(unit, 1, "w1");
  t.units.settle(unit, 0);
  t.answer(unit, 2, "w2");
  EXPECT_EQ(t.units.audit(), "unit 1 is settled without an answer on disk");
}

TEST(Audit, AFailedUnitHasNoAnswer) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  t.units.fail(unit);
  EXPECT_EQ(t.units.audit(), "");
  t.answer(unit, 1, "w1");
  EXPECT_EQ(t.units.audit(), "unit 1 failed and has an answer");
}

TEST(Audit, AUnitThatHasEndedIsNeitherQueuedNorLeased) {
  Tables queued;
  queued.units.fail(queued.queue(1));
  EXPECT_EQ(queued.units.audit(), "unit 1 has ended but is queued or leased");

  Tables leased;
  const UnitTable::Ref unit = leased.place(1);
  leased.grants.add(unit, leased.ready(1), 0);
  leased.answer(unit, 1, "w1");
  leased.units.settle(unit, 0);
  EXPECT_EQ(leased.units.audit(), "unit 1 has ended but is queued or leased");
}

TEST(Audit, AUnitWaitsInTheQueueThatItNames) {
  Tables t;
  t.queue(1);
  t.queue(2);
  t.units.close_pass(1);
  t.units.open_pass(1);
  t.place(2);  // its place in the queue is another one now
  EXPECT_EQ(t.units.audit(), "unit 2 does not wait in the queue that it names");
}

TEST(Audit, AnAnswerIsSomebodysAndThereOnce) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  t.units.add_answer(unit, digest_of(1));
  EXPECT_EQ(t.units.audit(), "an answer to unit 1 is nobody's");
  t.units.add_vote(unit, 0, t.trust.intern("w1"));
  EXPECT_EQ(t.units.audit(), "") << "it is being written";
  t.answer(unit, 1, "w2");
  EXPECT_EQ(t.units.audit(), "unit 1 has the same answer twice");
}

TEST(Audit, AnOpenUnitIsSomewhere) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  EXPECT_EQ(t.units.audit(), "unit 1 is open, but nobody has it and it does not wait");
  t.units.enqueue(unit);
  EXPECT_EQ(t.units.audit(), "");
}

TEST(Audit, AJobCountsWhatItsUnitsAddUpTo) {
  Tables t;
  const UnitTable::Ref unit = t.place(1);
  t.answer(unit, 1, "w1");
  t.units.settle(unit, 0);
  EXPECT_EQ(t.units.audit(), "job 1 counts 0 done and 0 failed, the table 1 and 0");
  Actions out;
  t.units.deliver(unit, out);
  EXPECT_EQ(t.units.audit(), "");
}

TEST(Audit, AWorkerWithoutAJobIsNeitherLeavingNorCounted) {
  Tables leaving;
  leaving.workers.set_leaving(leaving.idle(1), true);
  EXPECT_TRUE(says(leaving.workers.audit(), "worker 1 has no job"));

  Tables counted;
  counted.workers.count_for(counted.idle(1), counted.ada);
  EXPECT_TRUE(says(counted.workers.audit(), "worker 1 has no job"));
}

TEST(Audit, AWorkerServesSomebodysJobThatExists) {
  Tables nobody;
  nobody.workers.count_for(nobody.ready(1), std::nullopt);
  EXPECT_EQ(nobody.workers.audit(), "worker 1 serves job 1 for nobody");

  Tables ended;
  ended.ready(1);
  ended.units.end_job(1);
  EXPECT_EQ(ended.workers.audit(), "worker 1 serves a job that has ended");
}

TEST(Audit, NothingIsKnownOfEndedJobs) {
  Tables proven;
  proven.workers.prove(proven.idle(1), 1, "c");
  proven.units.end_job(1);
  EXPECT_EQ(proven.workers.audit(), "worker 1 proved its class for a job that has ended");
  proven.workers.forget_job(1);
  EXPECT_EQ(proven.workers.audit(), "");

  Tables lacking;
  lacking.workers.set_alone(1, 0, true);
  lacking.units.end_job(1);
  EXPECT_EQ(lacking.workers.audit(), "job 1 has ended and is still said to lack workers");
}

TEST(Audit, AUsersThreadsAreThoseOfTheWorkersCountedForTheUser) {
  Tables t;
  t.ready(1);
  t.workers.share().add_threads(t.ada, 1);
  EXPECT_EQ(t.workers.audit(), "threads of ada are miscounted");
}

TEST(Audit, AWorkerHoldsUnitsOfItsOwnJobWithinItsCredits) {
  Tables other;
  const WorkerTable::Ref worker = other.ready(1);
  const uint64_t lease = other.grants.add(other.place(1), worker, 0);
  other.workers.unassign(worker, 0);
  EXPECT_EQ(other.grants.audit(), "worker 1 holds a unit of job 1 and serves job 0");
  other.grants.release(lease);
  EXPECT_EQ(other.grants.audit(), "");
  other.grants.release(lease);  // a lease that has ended
  EXPECT_EQ(other.grants.audit(), "");

  Tables many;
  const WorkerTable::Ref holder = many.ready(1);
  for (uint64_t unit = 1; unit <= 2; ++unit) many.grants.add(many.place(unit), holder, 0);
  many.workers.make_ready(holder, 1, 0);
  EXPECT_EQ(many.grants.audit(), "worker 1 holds more than its credits");
}

TEST(Audit, LeasesAreBookedForTheJobsThatExist) {
  Tables t;
  t.grants.add_job(2);
  EXPECT_EQ(t.grants.audit(), "2 jobs have leases booked, 1 exist");
}

}  // namespace
}  // namespace kiln

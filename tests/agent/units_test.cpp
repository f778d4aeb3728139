// Units and results of a worker: withdrawn, held, kept, hanging.
#include <chrono>
#include <set>
#include <thread>

#include "common/wire/limits.h"
#include "tests/farm/stub_bake.h"
#include "tests/farm/worker_process.h"
#include "worker/agent/agent.h"

namespace kiln {
namespace {

using namespace test;

bool runs_one(RawPeer& peer) {
  while (const auto beat = peer.next<Heartbeat>())
    if (beat->running == 1) return true;
  return false;
}

TEST(AgentUnits, WithdrawnOnesAreNotBegunAndWhatRunsIsDropped) {
  const StubOptions stub("slow=300");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  for (const uint64_t id : {1, 2, 3}) peer->send(unit_of(job, id));
  ASSERT_TRUE(runs_one(*peer));
  peer->send(Withdraw{job.spec.id, {1, 2, 99}});
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->result.unit, 3u);
  peer->send(unit_of(job, 1));  // wanted after all
  const auto again = peer->next<Result>();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->result.unit, 1u);
}

TEST(AgentUnits, AWithdrawnUnitThatRunsIsDeliveredWhenItIsGivenAgain) {
  const StubOptions stub("slow=300");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 1));
  ASSERT_TRUE(runs_one(*peer));
  peer->send(Withdraw{job.spec.id, {1}});
  Unit again = unit_of(job, 1);
  again.lease = 4711;
  peer->send(again);
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->lease, 4711u);
  EXPECT_FALSE(peer->next<Result>(600)) << "the unit was baked twice";
}

TEST(AgentUnits, AWithdrawnResultIsForgotten) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    for (const uint64_t id : {5, 6}) {
      peer->send(unit_of(job, id));
      ASSERT_TRUE(peer->next<Result>());
    }
    peer->send(Withdraw{job.spec.id, {5}});
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->result.unit, 6u);
  EXPECT_FALSE(peer->next<Result>(300));
}

TEST(AgentUnits, AfterAReconnectTheUnitsThatAreHereAreNamed) {
  const StubOptions stub("slow=600");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer);
    const auto credits = make_ready(*peer, job);
    ASSERT_TRUE(credits);
    EXPECT_TRUE(credits->held.empty());
    for (const uint64_t id : {1, 2, 3}) peer->send(unit_of(job, id));
    ASSERT_TRUE(runs_one(*peer));
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  const auto credits = make_ready(*peer, job);
  ASSERT_TRUE(credits);
  EXPECT_EQ(credits->held, (std::vector<uint64_t>{1, 2, 3}));
  Unit second = unit_of(job, 2);
  second.lease = 4711;  // a new lease for the unit that is held: it is not baked twice
  peer->send(second);
  for (const uint64_t id : {1, 2, 3}) {
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    EXPECT_EQ(result->result.unit, id);
    EXPECT_EQ(result->lease, id == 2 ? 4711 : 100 + id);
    peer->send(CommitAck{job.spec.id, id, result->digest});
  }
  EXPECT_FALSE(peer->next<Result>(700));
}

TEST(AgentUnits, AUnitWhoseResultIsKeptIsAnsweredFromIt) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 5));
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  Unit again = unit_of(job, 5);
  again.lease = 4711;
  peer->send(again);
  const auto second = peer->next<Result>();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->digest, result->digest);
  EXPECT_EQ(second->lease, 4711u);
}

// After a rewind a number may stand for other work: what is kept, runs or waits of the earlier is not its
// answer.
TEST(AgentUnits, ANumberThatIsGivenToOtherWorkIsBakedAnew) {
  const StubOptions stub("slow=300");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  const auto other = [&](uint64_t id) {
    Unit unit = unit_of(job, id);
    unit.lease += 1000;
    unit.unit.replicate = 1;
    return unit;
  };
  peer->send(unit_of(job, 1));
  const auto first = peer->next<Result>();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->shape, unit_shape(unit_of(job, 1).unit));
  for (const uint64_t id : {2, 3}) peer->send(unit_of(job, id));
  ASSERT_TRUE(runs_one(*peer));
  for (const uint64_t id : {1, 2, 3}) peer->send(other(id));  // kept, runs, is queued
  std::set<uint64_t> answered;
  while (answered.size() < 3) {
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    const Unit unit = other(result->result.unit);
    EXPECT_EQ(result->lease, unit.lease);
    EXPECT_EQ(result->shape, unit_shape(unit.unit));
    EXPECT_EQ(result->result.moments, stub_bake(unit.unit, result->result.plane_count).moments);
    EXPECT_TRUE(answered.insert(unit.unit.id).second);
  }
  EXPECT_FALSE(peer->next<Result>(700));
}

TEST(AgentUnits, HeartbeatsTellTheAgeOfTheOldest) {
  const StubOptions stub("slow=700");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 1));
  uint64_t last = 0, rises = 0;
  while (auto message = peer->receive()) {
    if (const auto* beat = std::get_if<Heartbeat>(&*message); beat && beat->running == 1) {
      rises += beat->oldest_ms > last;
      last = beat->oldest_ms;
    }
    if (std::holds_alternative<Result>(*message)) break;
  }
  EXPECT_GE(rises, 2u);
  const auto idle = peer->next<Heartbeat>();
  ASSERT_TRUE(idle);
  EXPECT_EQ(idle->oldest_ms, 0u);
}

TEST(AgentUnits, AHangEndsTheProcessWithItsReason) {
  const TempDir cache;
  const StubOptions stub("hang=3");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port(), {"--unit-limit", "1", "--cache", cache.path().string()});
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 3));
  const auto failed = peer->next<UnitFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->unit, 3u);
  EXPECT_EQ(failed->lease, 103u);
  EXPECT_NE(failed->reason.find("more than 1 s"), std::string::npos) << failed->reason;
  EXPECT_NE(failed->reason.find("--replay " + cache.path().string()), std::string::npos) << failed->reason;
  peer->close();
  EXPECT_TRUE(worker.ended_with(1)) << worker.process.how_it_ended() << worker.said;
}

// Bakes with the stub's numbers inside this process.
class PlainBaker final : public Baker {
 public:
  Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache) const override {
    return stub_bake(unit, 19, cache);
  }
  size_t sites() const override { return kStubSites; }
  std::vector<std::string> warnings() const override { return {}; }
};

TEST(AgentUnits, WithTooMuchKeptNoUnitsAreWantedUntilItIsAcknowledged) {
  RawListener listener;
  const TestJob job;
  AgentSettings settings;
  settings.port = listener.port();
  settings.kept_bytes = 1000;
  settings.make_baker = [](Scene, Atlas, const TransportSettings&, unsigned) {
    return Expected<std::unique_ptr<Baker>>(std::make_unique<PlainBaker>());
  };
  settings.numeric_class = [](const std::string&) { return Expected<std::string>("plain"); };
  Status end;
  std::jthread agent([&] { end = run_agent(settings); });
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    peer->send(unit_of(job, 1));  // its result has 16 x 19 numbers
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    const auto none = peer->next<Credits>();
    ASSERT_TRUE(none);
    EXPECT_EQ(none->units, 0u);
    peer->send(CommitAck{job.spec.id, 1, result->digest});
    const auto some = peer->next<Credits>();
    ASSERT_TRUE(some);
    EXPECT_EQ(some->units, 1 + kPrefetchUnits);
    peer->send(Goodbye{"done"});
    peer->closed();
  }
  agent.join();
  EXPECT_TRUE(end) << end.error().message;
}

}  // namespace
}  // namespace kiln

// Units that name an irradiance cache, on a worker process.
#include <signal.h>

#include <chrono>
#include <limits>
#include <thread>

#include "common/responses/quantities.h"
#include "tests/farm/stub_caches.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {

using namespace test;

// A chunk that the job does not name, and what units of it must answer.
struct Blob {
  explicit Blob(uint32_t number, size_t sites = kStubSites)
      : cache(stub_cache(number, sites)), bytes(write_irradiance_cache(cache)), id(sha256(bytes)) {}
  Unit unit(const TestJob& job, uint64_t number, uint32_t replicate = 0) const {
    Unit unit = unit_of(job, number);
    unit.unit.replicate = replicate;
    unit.unit.cache = id;
    return unit;
  }
  Digest truth(const Unit& unit) const {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    return result_digest(stub_bake(unit.unit, planes, &cache));
  }
  void serve(RawPeer& peer) const { peer.send(ChunkPiece{id, 0, bytes.size(), bytes, true}); }
  IrradianceCache cache;
  Bytes bytes;
  Digest id;
};

bool asks_for(RawPeer& peer, const Blob& blob) {
  const auto request = peer.next<ChunkRequest>();
  return request && request->ids == std::vector<Digest>{blob.id};
}

bool answers(RawPeer& peer, const Unit& unit, const Digest& truth) {
  const auto result = peer.next<Result>();
  return result && result->result.unit == unit.unit.id && result->lease == unit.lease &&
         result->digest == truth;
}

// The next messages but heartbeats: none for some time.
bool is_quiet(RawPeer& peer) {
  for (int beats = 0; beats < 4;) {
    const auto message = peer.receive();
    if (!message || !std::holds_alternative<Heartbeat>(*message)) return false;
    ++beats;
  }
  return true;
}

TEST(AgentCaches, AUnitWaitsForItsCacheWhichIsAskedForOnce) {
  RawListener listener;
  const TestJob job;
  const Blob blob(1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  const Unit first = blob.unit(job, 1), second = blob.unit(job, 2, 1);
  peer->send(first);
  peer->send(second);
  ASSERT_TRUE(asks_for(*peer, blob));
  bool waits = false;
  for (int beats = 0; beats < 3 && !waits; ++beats) {
    const auto beat = peer->next<Heartbeat>();
    ASSERT_TRUE(beat);
    waits = beat->queued == 2 && beat->running == 0;
  }
  EXPECT_TRUE(waits) << "units that wait count as queued";
  EXPECT_TRUE(is_quiet(*peer));
  peer->send(unit_of(job, 3));  // does not wait behind them
  ASSERT_EQ(peer->next<Result>()->result.unit, 3u);
  blob.serve(*peer);
  EXPECT_TRUE(answers(*peer, first, blob.truth(first)));
  EXPECT_TRUE(answers(*peer, second, blob.truth(second)));
  const Unit later = blob.unit(job, 4);
  peer->send(later);
  EXPECT_TRUE(answers(*peer, later, blob.truth(later))) << "the cache is here";
}

TEST(AgentCaches, ThoseOfTwoReplicatesStayAndOlderOnesGo) {
  RawListener listener;
  const TestJob job;
  const Blob blobs[] = {Blob(1), Blob(2), Blob(3)};
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  uint64_t id = 1;
  const auto bake = [&](const Blob& blob, bool asked) {
    const Unit unit = blob.unit(job, id++);
    peer->send(unit);
    if (asked) {
      ASSERT_TRUE(asks_for(*peer, blob));
      blob.serve(*peer);
    }
    ASSERT_TRUE(answers(*peer, unit, blob.truth(unit)));
  };
  bake(blobs[0], true);
  bake(blobs[1], true);
  bake(blobs[0], false);
  bake(blobs[1], false);
  bake(blobs[2], true);
  bake(blobs[1], false);
  bake(blobs[0], true);  // two others were used after it
}

TEST(AgentCaches, ACacheThatCannotBeReadFailsItsUnitsAlone) {
  RawListener listener;
  const TestJob job;
  Blob few(1, 3), damaged(2), endless(3);
  damaged.bytes.resize(damaged.bytes.size() - 1);
  damaged.id = sha256(damaged.bytes);
  endless.cache.irradiance[5].x = std::numeric_limits<float>::infinity();
  endless.bytes = write_irradiance_cache(endless.cache);
  endless.id = sha256(endless.bytes);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  uint64_t id = 1;
  for (const auto& [blob, words] : {std::pair(&few, "3 texel sites"), std::pair(&damaged, "damaged"),
                                    std::pair(&endless, "not finite")}) {
    const Unit unit = blob->unit(job, id++);
    peer->send(unit);
    ASSERT_TRUE(asks_for(*peer, *blob));
    blob->serve(*peer);
    const auto failed = peer->next<UnitFailed>();
    ASSERT_TRUE(failed);
    EXPECT_EQ(failed->unit, unit.unit.id);
    EXPECT_EQ(failed->lease, unit.lease);
    EXPECT_EQ(failed->kind, ErrorKind::kInvalidInput);
    EXPECT_NE(failed->reason.find(words), std::string::npos) << failed->reason;
    EXPECT_NE(failed->reason.find(blob->id.hex()), std::string::npos) << failed->reason;
  }
  peer->send(unit_of(job, 9));
  EXPECT_TRUE(peer->next<Result>());
}

TEST(AgentCaches, AfterAReconnectTheUnitIsNotHeldAndAsksAgain) {
  RawListener listener;
  const TestJob job;
  const Blob blob(1);
  WorkerProcess worker(listener.port());
  const Unit unit = blob.unit(job, 1);
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    peer->send(unit);
    ASSERT_TRUE(asks_for(*peer, blob));
    const size_t half = blob.bytes.size() / 2;
    peer->send(ChunkPiece{blob.id, 0, blob.bytes.size(),
                          Bytes(blob.bytes.begin(), blob.bytes.begin() + static_cast<ptrdiff_t>(half)),
                          false});
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  const auto credits = make_ready(*peer, job);
  ASSERT_TRUE(credits);
  EXPECT_TRUE(credits->held.empty()) << "a coordinator would count on a unit that cannot be begun";
  EXPECT_TRUE(is_quiet(*peer));
  peer->send(unit);
  ASSERT_TRUE(asks_for(*peer, blob));
  blob.serve(*peer);
  EXPECT_TRUE(answers(*peer, unit, blob.truth(unit)));
}

// The coordinator dropped the cache before it was asked, withdrew the unit, and gives both again.
TEST(AgentCaches, AWithdrawnUnitWaitsNoLongerAndAsksAnewWhenItIsGivenAgain) {
  RawListener listener;
  const TestJob job;
  const Blob blob(1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  const Unit unit = blob.unit(job, 1);
  for (int round = 0; round < 2; ++round) {
    peer->send(unit);
    ASSERT_TRUE(asks_for(*peer, blob)) << round;
    peer->send(Withdraw{job.spec.id, {unit.unit.id}});
  }
  blob.serve(*peer);  // it was asked for, and nobody needs it
  EXPECT_TRUE(is_quiet(*peer)) << "a withdrawn unit was baked";
  peer->send(unit);
  EXPECT_TRUE(answers(*peer, unit, blob.truth(unit))) << "the chunk is here";
}

TEST(AgentCaches, TheEndOfItsJobEndsTheWait) {
  RawListener listener;
  const TestJob job(77), other(78);
  const Blob blob(1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(blob.unit(job, 1));
  ASSERT_TRUE(asks_for(*peer, blob));
  peer->send(JobEnded{job.spec.id, "cancelled"});
  const auto credits = give_job(*peer, other);
  ASSERT_TRUE(credits);
  EXPECT_TRUE(credits->held.empty());
  blob.serve(*peer);
  peer->send(unit_of(other, 1));
  EXPECT_TRUE(peer->next<Result>());
}

TEST(AgentCaches, AWorkerThatDrainsHandsBackWhatWaits) {
  RawListener listener;
  const TestJob job;
  const Blob blob(1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(blob.unit(job, 1));
  ASSERT_TRUE(asks_for(*peer, blob));
  worker.process.signal(SIGTERM);
  const auto drain = peer->next<Drain>();
  ASSERT_TRUE(drain);
  EXPECT_EQ(drain->units, std::vector<uint64_t>{1});
  EXPECT_TRUE(peer->next<Goodbye>());
  EXPECT_TRUE(worker.ended_with(0));
}

TEST(AgentCaches, AnotherProcessFindsThemOnDisk) {
  const TempDir folder;
  const TestJob job;
  const Blob blob(1);
  const Unit unit = blob.unit(job, 1);
  for (const bool asked : {true, false}) {
    RawListener listener;
    WorkerProcess worker(listener.port(), {"--cache", folder.path().string()});
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    peer->send(unit);
    if (asked) {
      ASSERT_TRUE(asks_for(*peer, blob));
      blob.serve(*peer);
    }
    ASSERT_TRUE(answers(*peer, unit, blob.truth(unit)));
    const std::string name = blob.id.hex();
    const auto file = folder.path() / "chunks" / name.substr(0, 2) / name;
    const SteadyClock clock;  // it is written behind the bake
    for (const int64_t limit = clock.now_ms() + 5000;
         !std::filesystem::exists(file) && clock.now_ms() < limit;)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace
}  // namespace kiln

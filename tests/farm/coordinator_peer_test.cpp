// The coordinator against peers that break the protocol. A pass runs in a thread; a real worker ends it.
#include <atomic>
#include <set>
#include <thread>

#include "common/base/format.h"
#include "common/responses/quantities.h"
#include "common/wire/limits.h"
#include "tests/farm/farm_support.h"
#include "tests/farm/raw_peer.h"
#include "tests/farm/stub_bake.h"

namespace kiln {
namespace {

using namespace test;

Hello good_hello(uint64_t instance = 1) {
  return {"test", "right token", "host", 1, instance, 1, "avx2", "none"};
}

// A farm without workers of its own that waits for units 1 to `count`.
class WaitingFarm {
 public:
  explicit WaitingFarm(size_t count = 2) : units_(make_units(1, count)), left_(count) {
    FarmSettings settings;
    settings.local_workers = 0;
    settings.token = "right token";
    settings.rules.lease_ms = 5000;
    settings.rules.residence_ms = 100;
    settings.others_may_come = true;
    farm_ = std::move(*start_farm(settings, job));
    thread_ = std::thread([this] {
      const auto keep = [](const WorkUnit&, const UnitResult&) -> Status { return {}; };
      outcome = farm_.job->run_pass(units_, 0, {keep, {}, {}});
    });
  }
  // Answers every unit, as a good worker does, and ends the pass.
  void finish() {
    RawPeer worker = RawPeer::connect(port());
    worker.send(good_hello(999));
    worker.send(JobClass{job.spec.id, "class"});
    worker.send(Credits{job.spec.id, 1});
    // The next unit may come before the acknowledgement of the last: that waits for the disk.
    for (size_t units = 0, acknowledged = 0; units < left_ || acknowledged < left_;) {
      const auto message = worker.receive();
      ASSERT_TRUE(message) << units << " units and " << acknowledged << " acknowledgements came";
      if (const auto* unit = std::get_if<Unit>(&*message)) {
        worker.send(answer(*unit));
        ++units;
      }
      acknowledged += std::holds_alternative<CommitAck>(*message);
    }
    join();
  }
  void join() {
    thread_.join();
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(*outcome, PassEnd::kComplete);
  }
  ~WaitingFarm() {
    if (!thread_.joinable()) return;
    thread_.detach();  // the test has failed already, and the pass would not end
    (void)farm_.job.release();
    (void)farm_.farm.release();
  }
  static Result answer(const Unit& unit) {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    Result r{unit.job, unit.lease, stub_bake(unit.unit, planes), {}};
    r.digest = result_digest(r.result);
    return r;
  }
  uint16_t port() const { return farm_.farm->port(); }

  const TestJob job;
  Expected<PassEnd> outcome = PassEnd::kTimeUp;

 private:
  std::vector<WorkUnit> units_;
  const size_t left_;  // that finish() bakes
  TestFarm farm_;
  std::thread thread_;
};

std::string refusal(RawPeer& peer) {
  const auto refused = peer.next<Refused>();
  return refused ? refused->reason : "(no refusal)";
}

TEST(Coordinator, AWrongTokenIsRefusedInWords) {
  WaitingFarm farm;
  for (const char* token : {"", "wrong", "right toke", "right token "}) {
    RawPeer peer = RawPeer::connect(farm.port());
    Hello hello = good_hello();
    hello.token = token;
    peer.send(hello);
    const auto first = peer.receive();
    ASSERT_TRUE(first && std::holds_alternative<Refused>(*first)) << token;
    EXPECT_NE(std::get<Refused>(*first).reason.find("--token-file"), std::string::npos);
    EXPECT_TRUE(peer.closed());
  }
  farm.finish();
}

TEST(Coordinator, AnotherVersionIsRefusedInWords) {
  WaitingFarm farm;
  for (const uint8_t version : {1, 9}) {
    RawPeer peer = RawPeer::connect(farm.port());
    Bytes frame = encode(good_hello(2));
    frame[2] = std::byte{version};
    peer.send_bytes(frame);
    const std::string words = refusal(peer);
    EXPECT_NE(words.find(text("version {} of the protocol", version)), std::string::npos) << words;
    EXPECT_NE(words.find("install the same release on both machines"), std::string::npos) << words;
  }
  farm.finish();
}

TEST(Coordinator, NothingIsServedBeforeTheHandShake) {
  WaitingFarm farm;
  RawPeer peer = RawPeer::connect(farm.port());
  peer.send(ChunkRequest{{farm.job.spec.scene}, false});
  EXPECT_NE(refusal(peer).find("Hello"), std::string::npos);
  farm.finish();
}

TEST(Coordinator, GarbageClosesTheConnectionAndNothingElse) {
  WaitingFarm farm;
  std::srand(5);
  for (int round = 0; round < 20; ++round) {
    RawPeer peer = RawPeer::connect(farm.port());
    Bytes noise(64);
    for (std::byte& b : noise) b = std::byte(std::rand() & 255);
    if (round % 2) {  // after a good hand-shake, with a flipped bit
      peer.send(good_hello(100 + round));
      ASSERT_TRUE(peer.next<Job>());
      noise = encode(JobClass{farm.job.spec.id, "class"});
      noise.back() ^= std::byte{1};
    }
    peer.send_bytes(noise);
    EXPECT_TRUE(peer.closed()) << round;
  }
  farm.finish();
}

TEST(Coordinator, ChunksArriveWholeCompressedOrNot) {
  WaitingFarm farm;
  const Digest largest = (*scene_chunks(*farm.job.chunks.find(farm.job.spec.scene)))[1];
  for (const bool compress : {false, true}) {
    RawPeer peer = RawPeer::connect(farm.port());
    peer.send(good_hello(compress));
    peer.send(ChunkRequest{{largest, farm.job.spec.atlas}, compress});
    Bytes bytes;
    uint64_t total = 1;
    for (; bytes.size() < total;) {
      const auto piece = peer.next<ChunkPiece>();
      ASSERT_TRUE(piece);
      ASSERT_EQ(piece->id, largest);
      ASSERT_EQ(piece->offset, bytes.size());
      EXPECT_LE(piece->bytes.size(), kChunkPieceBytes);
      total = piece->total;
      bytes.insert(bytes.end(), piece->bytes.begin(), piece->bytes.end());
    }
    EXPECT_GT(total, kChunkPieceBytes);  // in more than one piece
    EXPECT_EQ(sha256(bytes), largest);
    const auto next = peer.next<ChunkPiece>();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->id, farm.job.spec.atlas);
  }
  farm.finish();
}

TEST(Coordinator, AChunkOfNoJobIsNotServed) {
  WaitingFarm farm;
  RawPeer peer = RawPeer::connect(farm.port());
  peer.send(good_hello());
  peer.send(ChunkRequest{{Digest{}}, false});
  peer.send(ChunkRequest{{farm.job.spec.atlas}, false});
  const auto piece = peer.next<ChunkPiece>();
  ASSERT_TRUE(piece);
  EXPECT_EQ(piece->id, farm.job.spec.atlas);
  farm.finish();
}

// What a joined worker may not send: its connection is closed with the reason, its units go to another.
TEST(Coordinator, LiesAreRefusedAndTheUnitBakedElsewhere) {
  const auto lies = std::vector<std::function<void(Result&)>>{
      [](Result& r) { r.result.unit = 12345; },             // nobody asked
      [](Result& r) { r.digest.bytes[0] ^= 1; },            // damaged before it was framed
      [](Result& r) { r.result.moments[0] = 1e308 * 10; },  // infinite
      [](Result& r) { r.result.plane_count /= 2, r.result.moments.resize(r.result.moments.size() / 2); },
      [](Result& r) { r.result.seconds = -1; },
  };
  for (size_t i = 0; i < lies.size(); ++i) {
    WaitingFarm farm;
    RawPeer peer = RawPeer::connect(farm.port());
    peer.send(good_hello(i));
    peer.send(JobClass{farm.job.spec.id, "class"});
    peer.send(Credits{farm.job.spec.id, 1});
    const auto unit = peer.next<Unit>();
    ASSERT_TRUE(unit);
    Result lie = WaitingFarm::answer(*unit);
    lies[i](lie);
    peer.send(lie);
    EXPECT_NE(refusal(peer), "(no refusal)") << i;
    farm.finish();
  }
}

TEST(Coordinator, AProcessThatReconnectsIsTheSameWorkerAndDeliversWhatItKept) {
  WaitingFarm farm;
  std::optional<Unit> held;
  {
    RawPeer peer = RawPeer::connect(farm.port());
    peer.send(good_hello(7));
    const auto welcome = peer.next<Welcome>();
    ASSERT_TRUE(welcome);
    EXPECT_EQ(welcome->lease_ms, 5000u);
    peer.send(JobClass{farm.job.spec.id, "class"});
    peer.send(Credits{farm.job.spec.id, 1});
    held = peer.next<Unit>();
    ASSERT_TRUE(held);
  }
  RawPeer again = RawPeer::connect(farm.port());
  again.send(good_hello(7));
  const auto welcome = again.next<Welcome>();
  ASSERT_TRUE(welcome);
  again.send(JobClass{farm.job.spec.id, "class"});
  again.send(Credits{farm.job.spec.id, 1});
  again.send(WaitingFarm::answer(*held));
  const auto ack = again.next<CommitAck>();
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->unit, held->unit.id);
  EXPECT_EQ(ack->digest, WaitingFarm::answer(*held).digest);
  again.close();
  RawPeer last = RawPeer::connect(farm.port());  // bakes the rest
  last.send(good_hello(8));
  last.send(JobClass{farm.job.spec.id, "class"});
  last.send(Credits{farm.job.spec.id, 4});
  const auto unit = last.next<Unit>();
  ASSERT_TRUE(unit);
  EXPECT_NE(unit->unit.id, held->unit.id);
  last.send(WaitingFarm::answer(*unit));
  EXPECT_TRUE(last.next<CommitAck>());
  farm.join();
}

// A coordinator that was started again replays its passes: a worker may bring a result of one that it has not
// reached.
TEST(Coordinator, AResumedJobKeepsResultsOfPassesToCome) {
  const TestJob job;
  FarmSettings settings;
  settings.local_workers = 0;
  settings.token = "right token";
  settings.others_may_come = true;
  const auto farm = Farm::start(settings);
  ASSERT_TRUE(farm);
  const std::vector<WorkUnit> first = make_units(1, 1), second = make_units(2, 1);
  const KnownAnswer known{9, 9, {}, "somebody", true, false};
  const auto running = (*farm)->open_job({job.spec, &job.chunks, {}, {known}});
  ASSERT_TRUE(running);
  Expected<PassEnd> one = PassEnd::kTimeUp, two = PassEnd::kTimeUp;
  std::thread conductor([&] {
    one = (*running)->run_pass(first, 0, {});
    two = (*running)->run_pass(second, 0, {});
  });
  RawPeer peer = RawPeer::connect((*farm)->port());
  peer.send(good_hello());
  ASSERT_TRUE(peer.next<Job>());
  peer.send(JobClass{job.spec.id, "class"});
  peer.send(WaitingFarm::answer({job.spec.id, 0, second[0]}));  // before its pass
  peer.send(Credits{job.spec.id, 1});
  const auto unit = peer.next<Unit>();
  ASSERT_TRUE(unit);
  EXPECT_EQ(unit->unit.id, 1u);
  peer.send(WaitingFarm::answer(*unit));
  std::set<uint64_t> acknowledged;
  while (acknowledged.size() < 2) {
    const auto ack = peer.next<CommitAck>();
    ASSERT_TRUE(ack) << "the result of the pass to come was lost";
    acknowledged.insert(ack->unit);
  }
  conductor.join();
  EXPECT_TRUE(one && *one == PassEnd::kComplete);
  EXPECT_TRUE(two && *two == PassEnd::kComplete);
}

// What is said while the conductor is at work on the next pass.
TEST(Coordinator, ARewindBetweenPassesIsHeardByTheNext) {
  const TestJob job;
  FarmSettings settings;
  settings.local_workers = 0;
  settings.token = "right token";
  settings.others_may_come = true;
  auto farm = start_farm(settings, job);
  ASSERT_TRUE(farm);
  const std::vector<WorkUnit> first = make_units(1, 1);
  Expected<PassEnd> end = PassEnd::kTimeUp;
  std::thread conductor([&] { end = farm->job->run_pass(first, 0, {}); });
  const auto join = [&](uint64_t instance) {
    RawPeer peer = RawPeer::connect(farm->farm->port());
    peer.send(good_hello(instance));
    EXPECT_TRUE(peer.next<Welcome>());
    peer.send(JobClass{job.spec.id, "class"});
    return peer;
  };
  RawPeer one = join(1), two = join(2);
  one.send(Credits{job.spec.id, 1});
  const auto unit = one.next<Unit>();
  ASSERT_TRUE(unit);
  one.send(WaitingFarm::answer(*unit));
  conductor.join();
  ASSERT_TRUE(end && *end == PassEnd::kComplete);
  Result other = WaitingFarm::answer(*unit);
  other.result.moments[0] *= 0.5;
  other.digest = result_digest(other.result);
  two.send(other);
  const SteadyClock clock;
  for (const int64_t limit = clock.now_ms() + 5000;
       farm->job->statistics().duplicates == 0 && clock.now_ms() < limit;)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  const auto next = farm->job->run_pass(make_units(2, 1), clock.now_ms() + 3000, {});
  ASSERT_TRUE(next) << next.error().message;
  EXPECT_EQ(*next, PassEnd::kRewound);
}

TEST(Coordinator, ListeningBeyondThisMachineNeedsAToken) {
  FarmSettings settings;
  settings.local_workers = 0;
  for (const char* host : {"0.0.0.0", "127.evil.example", "localhost.evil"}) {
    settings.listen_host = host;
    const auto farm = Farm::start(settings);
    ASSERT_FALSE(farm);
    EXPECT_EQ(farm.error().kind, ErrorKind::kUsage) << farm.error().message;
  }
}

TEST(Coordinator, APortThatIsTakenIsAnErrorThatNamesIt) {
  const RawListener taken;
  FarmSettings settings;
  settings.local_workers = 0;
  settings.listen_port = taken.port();
  const auto farm = Farm::start(settings);
  ASSERT_FALSE(farm);
  EXPECT_NE(farm.error().message.find(std::to_string(taken.port())), std::string::npos);
}

}  // namespace
}  // namespace kiln

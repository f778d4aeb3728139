// A real worker process against a coordinator played by the test.
#include <signal.h>

#include "common/wire/limits.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {

using namespace test;

TEST(Agent, HelloComesFirstAndAloneUntilItIsAnswered) {
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  const auto first = peer->receive();
  ASSERT_TRUE(first && std::holds_alternative<Hello>(*first));
  const Hello& hello = std::get<Hello>(*first);
  EXPECT_EQ(hello.token, "token");
  EXPECT_EQ(hello.threads, 1u);
  EXPECT_EQ(hello.pid, static_cast<uint32_t>(worker.process.pid()));
  EXPECT_FALSE(peer->receive(200)) << "something was asked for before the coordinator answered";
}

TEST(Agent, ChunksAreFetchedOnceAndKeptAcrossConnections) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  size_t asked = 0;
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer);
    const auto credits = make_ready(*peer, job, &asked);
    ASSERT_TRUE(credits);
    EXPECT_EQ(credits->units, 1 + kPrefetchUnits);
    EXPECT_EQ(asked, job.chunks.size());
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  EXPECT_TRUE(make_ready(*peer, job, &asked));
  EXPECT_EQ(asked, job.chunks.size());
}

TEST(Agent, ADamagedChunkIsNeverUsed) {
  RawListener listener;
  TestJob job;
  WorkerProcess worker(listener.port());
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && peer->next<Hello>());
    peer->send(Welcome{1, 100, 1000});
    peer->send(Job{job.spec});
    const auto request = peer->next<ChunkRequest>();
    ASSERT_TRUE(request);
    Bytes bytes = *job.chunks.find(request->ids[0]);
    bytes[bytes.size() / 2] ^= std::byte{1};
    peer->send(ChunkPiece{request->ids[0], 0, bytes.size(), bytes, false});
    EXPECT_TRUE(peer->closed());
  }
  size_t asked = 0;
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  EXPECT_TRUE(make_ready(*peer, job, &asked));
  EXPECT_EQ(asked, job.chunks.size());
}

TEST(Agent, AResultIsKeptUntilItsDigestIsAcknowledged) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  Digest digest;
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    peer->send(unit_of(job, 5));
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    digest = result->digest;
    peer->send(CommitAck{job.spec.id, 5, Digest{}});  // of other bytes: does not count
  }
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    const auto again = peer->next<Result>();
    ASSERT_TRUE(again) << "the result was forgotten";
    EXPECT_EQ(again->digest, digest);
    EXPECT_EQ(again->result.unit, 5u);
    peer->send(CommitAck{job.spec.id, 5, digest});
    ASSERT_TRUE(peer->next<Heartbeat>());
    ASSERT_TRUE(peer->next<Heartbeat>());
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  EXPECT_FALSE(peer->next<Result>(50)) << "an acknowledged result came again";
}

TEST(Agent, SigtermFinishesWhatRunsAndHandsBackTheRest) {
  const StubOptions stub("slow=2000");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  for (const uint64_t id : {1, 2, 3}) peer->send(unit_of(job, id));
  while (const auto beat = peer->next<Heartbeat>())
    if (beat->running == 1 && beat->queued == 2) break;
  worker.process.signal(SIGTERM);
  const auto drain = peer->next<Drain>();
  ASSERT_TRUE(drain);
  EXPECT_EQ(drain->units, (std::vector<uint64_t>{2, 3}));
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->result.unit, 1u);
  peer->send(unit_of(job, 4));  // crossed the drain on the wire
  const auto more = peer->next<Drain>();
  ASSERT_TRUE(more);
  EXPECT_EQ(more->units, std::vector<uint64_t>{4});
  peer->send(CommitAck{job.spec.id, 1, result->digest});
  EXPECT_TRUE(peer->next<Goodbye>());
  peer->close();
  EXPECT_TRUE(worker.ended_with(0)) << worker.process.how_it_ended() << worker.said;
}

TEST(Agent, HeartbeatsComeWhileUnitsRun) {
  const StubOptions stub("slow=600");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 1));
  size_t beats = 0;
  while (auto message = peer->receive()) {
    if (const auto* beat = std::get_if<Heartbeat>(&*message); beat && beat->running == 1) ++beats;
    if (std::holds_alternative<Result>(*message)) break;
  }
  EXPECT_GE(beats, 2u);
}

TEST(Agent, ARefusalEndsTheWorkerWithItsReason) {
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && peer->next<Hello>());
  peer->send(Refused{"no room at the inn"});
  EXPECT_TRUE(worker.ended_with(2)) << worker.process.how_it_ended();
  EXPECT_NE(worker.said.find("no room at the inn"), std::string::npos) << worker.said;
}

TEST(Agent, ACoordinatorOfAnotherMajorEndsTheWorker) {
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && peer->next<Hello>());
  Bytes frame = encode(Welcome{1, 100, 1000});
  frame[2] = std::byte{9};
  peer->send_bytes(frame);
  EXPECT_TRUE(worker.ended_with(2)) << worker.process.how_it_ended();
  EXPECT_NE(worker.said.find("same release"), std::string::npos) << worker.said;
}

TEST(Agent, GoodbyeEndsTheWorkerInOrder) {
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && peer->next<Hello>());
  peer->send(Welcome{1, 100, 1000});
  peer->send(Goodbye{"the bake has ended"});
  EXPECT_TRUE(worker.ended_with(0)) << worker.process.how_it_ended();
}

TEST(Agent, WithoutACoordinatorPatienceEnds) {
  uint16_t nobody;
  {
    const RawListener listener;
    nobody = listener.port();
  }
  WorkerProcess worker(nobody, {"--patience", "1"});
  EXPECT_TRUE(worker.ended_with(1)) << worker.process.how_it_ended();
  EXPECT_NE(worker.said.find("Is it running"), std::string::npos) << worker.said;
}

TEST(Agent, WrongUsageIsSaid) {
  const std::string program = (binary_dir() / "bin/kiln-stub-worker").string();
  for (const char* wrong :
       {"", "--connect nowhere", "--connect a:1 --threads 0", "--nonsense", "--connect"}) {
    const auto result = run_command(program + " " + wrong);
    EXPECT_EQ(result.exit_status, 2) << wrong;
    EXPECT_FALSE(result.output.empty());
  }
  EXPECT_EQ(run_command(program + " --version").exit_status, 0);
  const auto help = run_command(program + " --help");
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_NE(help.output.find("examples:"), std::string::npos);
}

}  // namespace
}  // namespace kiln

// The stub worker misbehaves as it is told: what tests of the coordinator rely on.
#include "common/responses/quantities.h"
#include "tests/farm/stub_bake.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {

using namespace test;

UnitResult true_result(uint64_t id) {
  const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
  return stub_bake(make_units(id, 1)[0], planes);
}

std::optional<Result> answer(const std::string& options, uint64_t unit) {
  const StubOptions stub(options);
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  if (!peer || !make_ready(*peer, job)) return std::nullopt;
  peer->send(unit_of(job, unit));
  return peer->next<Result>();
}

TEST(StubWorker, LiesHaveTheRightFormAndTheDigestOfTheLie) {
  for (const char* lie :
       {"wrong=5", "wrong=all", "wrong=%5", "zeros=5", "someone=5", "factor=2;slow=1;zeros=all"}) {
    const auto result = answer(lie, 5);
    ASSERT_TRUE(result) << lie;
    EXPECT_NE(result->digest, result_digest(true_result(5))) << lie;
    EXPECT_EQ(result->digest, result_digest(result->result)) << lie;
    EXPECT_EQ(result->result.moments.size(), true_result(5).moments.size()) << lie;
    EXPECT_EQ(result->result.unit, std::string(lie) == "someone=5" ? 6u : 5u) << lie;
  }
  for (const char* truth : {"", "wrong=6", "wrong=%4"})
    EXPECT_EQ(answer(truth, 5)->digest, result_digest(true_result(5))) << truth;
}

TEST(StubWorker, OneOfSeveralCanBeTheCulprit) {
  const TempDir dir;
  size_t lies = 0;
  for (int process = 0; process < 3; ++process)
    lies += answer("wrong=all;first_only=1;dir=" + dir.path().string(), 5)->digest !=
            result_digest(true_result(5));
  EXPECT_EQ(lies, 1u);
}

TEST(StubWorker, ResultsComeSeveralTimes) {
  const StubOptions stub("copies=3");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  peer->send(unit_of(job, 5));
  for (int copy = 0; copy < 3; ++copy) {
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    EXPECT_EQ(result->digest, result_digest(true_result(5)));
  }
  EXPECT_FALSE(peer->next<Result>(200));
}

TEST(StubWorker, BitsFlipOnTheWay) {
  const StubOptions stub("flip=2");
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && peer->next<Hello>());  // the first is whole
  peer->send(Welcome{1, 100, 1000});
  const auto frame = peer->receive_frame(5000);
  ASSERT_TRUE(frame);
  const std::span<const std::byte> bytes(*frame);
  const auto header = read_frame_header(bytes.first<kFrameHeaderBytes>());
  ASSERT_TRUE(header);
  EXPECT_FALSE(check_frame_payload(*header, bytes.subspan(kFrameHeaderBytes)));
}

TEST(StubWorker, AnotherVersionIsStated) {
  const StubOptions stub("version=9");
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer);
  const auto frame = peer->receive_frame(5000);
  ASSERT_TRUE(frame);
  EXPECT_EQ((*frame)[2], std::byte{9});
}

TEST(StubWorker, ADeafWorkerBakesWhatWasWithdrawn) {
  const StubOptions stub("slow=200;deaf=withdraw");
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  for (const uint64_t id : {1, 2}) peer->send(unit_of(job, id));
  peer->send(Withdraw{job.spec.id, {1, 2}});
  for (const uint64_t id : {1, 2}) {
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    EXPECT_EQ(result->result.unit, id);
  }
}

}  // namespace
}  // namespace kiln

// A worker of many jobs: switching, ending, staying when one cannot be done, memory.
#include "common/wire/limits.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {

using namespace test;

size_t times_said(const WorkerProcess& worker, const std::string& words) {
  size_t count = 0;
  for (size_t at = 0; (at = worker.said.find(words, at)) != std::string::npos; ++at) ++count;
  return count;
}

TEST(AgentJobs, AnEndedJobIsForgottenAndAnotherMayFollow) {
  RawListener listener;
  const TestJob job(77), other(78);  // of the same scene
  WorkerProcess worker(listener.port());
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job));
    peer->send(unit_of(job, 5));
    ASSERT_TRUE(peer->next<Result>());
    peer->send(JobEnded{job.spec.id, "it is published"});
    ASSERT_TRUE(peer->next<Heartbeat>() && peer->next<Heartbeat>());
    size_t asked = 0;
    ASSERT_TRUE(give_job(*peer, other, &asked));
    EXPECT_EQ(asked, 0u) << "chunks that are here were asked for again";
    peer->send(unit_of(other, 5));
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    EXPECT_EQ(result->job, other.spec.id);
  }
  auto peer = listener.accept();
  ASSERT_TRUE(peer && welcome(*peer));
  const auto kept = peer->next<Result>();  // no job was given: after two heartbeats it comes all the same
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->job, other.spec.id);
  EXPECT_FALSE(peer->next<Result>(300)) << "a result of the ended job came";
}

TEST(AgentJobs, AnEndedJobsUnitsDoNotRunOn) {
  const TempDir marks;
  const StubOptions stub("slow=200;dir=" + marks.path().string());
  RawListener listener;
  const TestJob job(77), other(78);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  for (const uint64_t id : {1, 2, 3}) peer->send(unit_of(job, id));
  peer->send(JobEnded{job.spec.id, "cancelled"});
  ASSERT_TRUE(give_job(*peer, other));
  peer->send(unit_of(other, 9));
  const auto result = peer->next<Result>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->job, other.spec.id);
  EXPECT_EQ(result->result.unit, 9u);
  for (const auto& entry : std::filesystem::directory_iterator(marks.path()))
    EXPECT_NE(entry.path().filename().string().rfind("unit-3-", 0), 0u) << "begun for nobody";
}

TEST(AgentJobs, ResultsOfAnEarlierJobArriveWhileAnotherIsCurrent) {
  const StubOptions stub("slow=200");
  RawListener listener;
  const TestJob first(77, 0), second(78, 1);
  WorkerProcess worker(listener.port());
  Digest digest;
  {
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, first));
    for (const uint64_t id : {1, 2}) peer->send(unit_of(first, id));
    peer->send(Job{second.spec});  // units 1 and 2 are on their way
    bool ready = false;
    std::set<uint64_t> units;
    while (auto message = peer->receive()) {
      if (const auto* request = std::get_if<ChunkRequest>(&*message))
        serve_chunks(*peer, second.chunks, *request);
      if (const auto* credits = std::get_if<Credits>(&*message))
        ready = ready || credits->job == second.spec.id;
      if (const auto* result = std::get_if<Result>(&*message)) {
        EXPECT_EQ(result->job, first.spec.id);
        units.insert(result->result.unit);
      }
      if (ready && units.size() == 2) break;
    }
    EXPECT_TRUE(ready);
    EXPECT_EQ(units, (std::set<uint64_t>{1, 2}));
  }
  auto peer = listener.accept();  // neither was acknowledged: they come again, after the class
  ASSERT_TRUE(peer && make_ready(*peer, second));
  const auto stated = peer->next<JobClass>();
  ASSERT_TRUE(stated);
  EXPECT_EQ(stated->job, first.spec.id);
  for (const uint64_t id : {1, 2}) {
    const auto result = peer->next<Result>();
    ASSERT_TRUE(result);
    EXPECT_EQ(result->job, first.spec.id);
    EXPECT_EQ(result->result.unit, id);
    peer->send(CommitAck{first.spec.id, id, result->digest});
  }
}

TEST(AgentJobs, SwitchingBackNeedsNothingAgain) {
  RawListener listener;
  const TestJob first(77, 0), second(78, 1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, first) && give_job(*peer, second));
  for (int round = 0; round < 3; ++round)
    for (const TestJob* job : {&first, &second}) {
      size_t asked = 0;
      ASSERT_TRUE(give_job(*peer, *job, &asked));
      EXPECT_EQ(asked, 0u);
      peer->send(unit_of(*job, 5));
      const auto result = peer->next<Result>();
      ASSERT_TRUE(result);
      EXPECT_EQ(result->job, job->spec.id);
    }
  peer->send(Goodbye{"done"});
  ASSERT_TRUE(worker.ended_with(0));
  EXPECT_EQ(times_said(worker, "making the scene"), 2u) << worker.said;
}

TEST(AgentJobs, WithoutRoomTheSceneUsedLongestAgoLeaves) {
  RawListener listener;
  const TestJob first(77, 0), second(78, 1);
  // A scene of 4.5 MB counts as 18 MB: 3/4 of 32 MiB holds one.
  WorkerProcess worker(listener.port(), {"--memory", "32"});
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, first) && give_job(*peer, second) && give_job(*peer, first));
  peer->send(unit_of(first, 5));
  ASSERT_TRUE(peer->next<Result>());
  peer->send(Goodbye{"done"});
  ASSERT_TRUE(worker.ended_with(0));
  EXPECT_EQ(times_said(worker, "making the scene"), 3u) << worker.said;
  EXPECT_EQ(times_said(worker, "leaves memory"), 2u) << worker.said;
}

TEST(AgentJobs, OnlyTheSceneUsedLongestAgoLeaves) {
  RawListener listener;
  const TestJob first(77, 0), second(78, 1), third(79, 2);
  WorkerProcess worker(listener.port(), {"--memory", "56"});  // 3/4 of it holds two
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, first) && give_job(*peer, second) && give_job(*peer, first));
  ASSERT_TRUE(give_job(*peer, third) && give_job(*peer, first));
  peer->send(Goodbye{"done"});
  ASSERT_TRUE(worker.ended_with(0));
  EXPECT_EQ(times_said(worker, "making the scene"), 3u) << worker.said;
  EXPECT_EQ(times_said(worker, "the scene of job 78 leaves memory"), 1u) << worker.said;
}

TEST(AgentJobs, WithoutRoomASceneWaitsForTheUnitsOfTheOther) {
  const StubOptions stub("slow=400");
  RawListener listener;
  const TestJob first(77, 0), second(78, 1);
  WorkerProcess worker(listener.port(), {"--memory", "32"});
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, first));
  peer->send(unit_of(first, 5));
  peer->send(Job{second.spec});
  bool delivered = false;
  while (auto message = peer->receive()) {
    if (const auto* request = std::get_if<ChunkRequest>(&*message))
      serve_chunks(*peer, second.chunks, *request);
    if (std::holds_alternative<Result>(*message)) delivered = true;
    if (const auto* credits = std::get_if<Credits>(&*message); credits && credits->job == second.spec.id) {
      EXPECT_TRUE(delivered) << "two scenes were in memory";
      delivered = false;
      break;
    }
  }
  EXPECT_FALSE(delivered) << "the second job never became ready";
}

TEST(AgentJobs, AJobThisMachineCannotDoDoesNotEndTheWorker) {
  const StubOptions stub("no_class=avx512");
  RawListener listener;
  TestJob impossible(77);
  impossible.spec.transport.isa = "avx512";
  const TestJob possible(78);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && welcome(*peer));
  peer->send(Job{impossible.spec});
  const auto failed = peer->next<JobFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->job, 77u);
  EXPECT_NE(failed->reason.find("avx512"), std::string::npos);
  // The chunks that were asked for the first job never came.
  EXPECT_TRUE(give_job(*peer, possible));
}

TEST(AgentJobs, ChunksOfAnAbandonedJobAreNotAnOffence) {
  RawListener listener;
  const TestJob first(77, 0), second(78, 1);
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && welcome(*peer));
  peer->send(Job{first.spec});
  const auto request = peer->next<ChunkRequest>();
  ASSERT_TRUE(request);
  peer->send(Job{second.spec});
  serve_chunks(*peer, first.chunks, *request);
  EXPECT_TRUE(give_job(*peer, second));
}

TEST(AgentJobs, ThePaceIsWhatTheCoordinatorSays) {
  RawListener listener;
  WorkerProcess worker(listener.port());
  auto peer = listener.accept();
  ASSERT_TRUE(peer && peer->next<Hello>());
  peer->send(Welcome{1, 4000000000u, 4000000000u});  // as good as never
  ASSERT_TRUE(peer->next<Heartbeat>());
  EXPECT_FALSE(peer->next<Heartbeat>(300));
  peer->send(Pace{50});
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(peer->next<Heartbeat>());
}

}  // namespace
}  // namespace kiln

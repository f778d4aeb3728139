// Whole farms of real processes with the stub worker. Results are bounded, never speed.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>
#include <utility>

#include "common/base/clock.h"
#include "common/responses/quantities.h"
#include "tests/farm/farm_support.h"
#include "tests/farm/stub_bake.h"

namespace kiln {
namespace {

using namespace test;

const std::map<uint64_t, std::vector<double>>& truth() {
  static const auto made = [] {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    std::map<uint64_t, std::vector<double>> moments;
    for (const WorkUnit& u : make_units(100, 40)) moments[u.id] = stub_bake(u, planes).moments;
    return moments;
  }();
  return made;
}

void expect_truth(const PassOutcome& outcome) {
  ASSERT_TRUE(outcome.complete) << outcome.complete.error().message;
  EXPECT_TRUE(*outcome.complete);
  EXPECT_EQ(outcome.moments, truth()) << outcome.events();
}

TEST(Farm, AnyNumberOfWorkersGivesTheSameContent) {
  for (const uint32_t workers : {1u, 2u, 5u}) {
    const PassOutcome outcome = bake(stub_settings(workers, 2), make_units(100, 40));
    expect_truth(outcome);
    EXPECT_EQ(outcome.statistics.units, 40u);
    EXPECT_EQ(outcome.statistics.rays, 40u * 16 * 8);
    EXPECT_EQ(outcome.statistics.workers_lost, 0u);
    EXPECT_EQ(outcome.statistics.numeric_class, "avx2-stub");
  }
}

TEST(Farm, SeveralPassesOnOneFarm) {
  const TestJob job;
  auto farm = start_farm(stub_settings(2), job);
  ASSERT_TRUE(farm) << farm.error().message;
  size_t results = 0;
  const auto count = [&](const WorkUnit&, const UnitResult&) -> Status {
    ++results;
    return {};
  };
  for (uint32_t pass = 0; pass < 5; ++pass) {
    const auto done = farm->job->run_pass(make_units(1000 * pass + 1, 20, pass * 8), 0, {count, {}, {}});
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_EQ(*done, PassEnd::kComplete);
  }
  const auto empty = farm->job->run_pass({}, 0, {count, {}, {}});
  EXPECT_TRUE(empty && *empty == PassEnd::kComplete);
  EXPECT_EQ(results, 100u);
}

TEST(Farm, AKilledWorkerCostsNothing) {
  const TempDir dir;
  const StubOptions stub("slow=10;dir=" + dir.path().string());
  const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40), [&](size_t done) {
    if (done == 8) ::kill(busy_workers(dir.path()).front(), SIGKILL);
  });
  expect_truth(outcome);
  EXPECT_EQ(outcome.statistics.workers_lost, 1u) << outcome.events();
}

TEST(Farm, AStoppedWorkersUnitsGoToAnother) {
  const TempDir dir;
  const StubOptions stub("slow=10;dir=" + dir.path().string());
  FarmSettings settings = stub_settings(2);
  settings.rules.lease_ms = 400;
  pid_t stopped = 0;
  const PassOutcome outcome = bake(settings, make_units(100, 40), [&](size_t done) {
    if (done == 8) ::kill(stopped = busy_workers(dir.path()).front(), SIGSTOP);
  });
  expect_truth(outcome);
  EXPECT_FALSE(alive(stopped));  // a stopped worker is not left behind
}

// The only worker, so that nobody else answers its units before its lease has run out.
TEST(Farm, AWorkerThatComesBackIsHeardAgain) {
  const StubOptions stub("slow=10");
  FarmSettings settings = stub_settings(1);
  settings.rules.lease_ms = 300;
  const TestJob job;
  auto farm = start_farm(settings, job);
  ASSERT_TRUE(farm) << farm.error().message;
  const auto said = [&](const std::string& words) {
    const std::vector<std::string> events = farm->job->statistics().events;
    return std::any_of(events.begin(), events.end(),
                       [&](const std::string& e) { return e.find(words) != std::string::npos; });
  };
  std::map<uint64_t, std::vector<double>> moments;
  pid_t stopped = 0;
  PassHandlers handlers;
  handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) -> Status {
    moments[unit.id] = result.moments;
    if (moments.size() == 4) ::kill(stopped = children_of(::getpid()).front(), SIGSTOP);
    return {};
  };
  handlers.on_progress = [&](const FarmProgress&) {
    if (stopped != 0 && said("silent")) ::kill(std::exchange(stopped, 0), SIGCONT);
  };
  const auto end = farm->job->run_pass(make_units(100, 40), 0, handlers);
  ASSERT_TRUE(end && *end == PassEnd::kComplete);
  EXPECT_EQ(moments, truth());
  EXPECT_GE(farm->job->statistics().reassigned, 1u);
  EXPECT_TRUE(said("is back"));
}

// What is first said of a pass is not the end of the one before.
TEST(Farm, ProgressBeginsAnewWithEveryPass) {
  const StubOptions stub("slow=150");  // longer than a busy machine holds up the first message
  const TestJob job;
  auto farm = start_farm(stub_settings(1), job);
  ASSERT_TRUE(farm) << farm.error().message;
  std::vector<FarmProgress> said;
  PassHandlers handlers;
  handlers.on_result = [](const WorkUnit&, const UnitResult&) -> Status { return {}; };
  handlers.on_progress = [&](const FarmProgress& now) { said.push_back(now); };
  for (const uint64_t first : {100, 200, 300}) {
    said.clear();
    ASSERT_TRUE(farm->job->run_pass(make_units(first, 6), 0, handlers));
    ASSERT_GE(said.size(), 2u);
    EXPECT_EQ(said.front().units_done, 0u) << first;
    EXPECT_EQ(said.front().weight_done, 0) << first;
    EXPECT_GT(said.back().weight_done, 0) << first;
  }
}

TEST(Farm, UnitsAnsweredTwiceAreCommittedOnce) {
  const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40), {}, 0, quorum_of_two());
  expect_truth(outcome);
  EXPECT_GE(outcome.statistics.duplicates, 40u);
}

TEST(Farm, ASecondAnswerWithOtherBytesFailsThePass) {
  const TempDir dir;
  const StubOptions stub("other=103;dir=" + dir.path().string());
  FarmSettings settings = stub_settings(2);
  settings.rules.lease_ms = 500;
  const PassOutcome outcome = bake(settings, make_units(100, 40), {}, 0, quorum_of_two());
  ASSERT_FALSE(outcome.complete);
  EXPECT_NE(outcome.complete.error().message.find("different bytes"), std::string::npos)
      << outcome.complete.error().message;
  EXPECT_NE(outcome.events().find("unit 103 was answered with different bytes"), std::string::npos)
      << outcome.events();
  EXPECT_FALSE(outcome.moments.count(103));
}

TEST(Farm, AUnitThatCrashesWorkersFailsAfterThreeAndIsNamed) {
  const TempDir dir;
  const StubOptions stub("crash=107;dir=" + dir.path().string());
  const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40));
  ASSERT_FALSE(outcome.complete);
  EXPECT_NE(outcome.complete.error().message.find("unit 107 failed 3 times"), std::string::npos)
      << outcome.complete.error().message;
  size_t processes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dir.path()))
    processes += entry.path().filename().string().rfind("unit-107-", 0) == 0;
  EXPECT_EQ(processes, 4u);  // once among others, which proves nothing, and three times alone
}

TEST(Farm, AUnitThatFailsInOrderIsRetriedThenNamed) {
  const StubOptions stub("fail=104");
  const PassOutcome outcome = bake(stub_settings(3), make_units(100, 40));
  ASSERT_FALSE(outcome.complete);
  EXPECT_NE(outcome.complete.error().message.find("unit 104"), std::string::npos);
  EXPECT_NE(outcome.complete.error().message.find("not enough memory"), std::string::npos);
}

TEST(Farm, InvalidInputFailsAtOnceWithItsKind) {
  const StubOptions stub("invalid=104");
  const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40));
  ASSERT_FALSE(outcome.complete);
  EXPECT_EQ(outcome.complete.error().kind, ErrorKind::kInvalidInput);
  EXPECT_EQ(outcome.complete.error().message.find("failed 3 times"), std::string::npos);
}

TEST(Farm, ResultsThatCannotBeTrueAreRefused) {
  for (const auto& [lie, words] : {std::pair("nan=105", "holds nan"), std::pair("shape=105", "15 sites")}) {
    const StubOptions stub(lie);
    const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40));
    ASSERT_FALSE(outcome.complete) << lie;
    EXPECT_FALSE(outcome.moments.count(105));
    EXPECT_NE(outcome.events().find(words), std::string::npos) << outcome.events();
    EXPECT_NE(outcome.events().find("unit 105"), std::string::npos) << outcome.events();
    // Both workers lied and were sent away: the error says so.
    EXPECT_EQ(outcome.complete.error().kind, ErrorKind::kUnavailable);
    EXPECT_NE(outcome.complete.error().message.find("refused this worker"), std::string::npos)
        << outcome.complete.error().message;
  }
}

TEST(Farm, AWorkerOfAnotherClassIsRefusedAndTheRestFinish) {
  const TempDir dir;
  // Units long enough that the odd one is there before the others have baked all.
  const StubOptions stub("slow=50;first_class=other;dir=" + dir.path().string());
  const PassOutcome outcome = bake(stub_settings(3), make_units(100, 40));
  ASSERT_TRUE(outcome.complete) << outcome.complete.error().message;
  EXPECT_EQ(outcome.moments, truth());
  EXPECT_NE(outcome.events().find("numeric class"), std::string::npos) << outcome.events();
}

TEST(Farm, NoWorkerLeftIsAnErrorWithTheReason) {
  const StubOptions stub("refuse=1");
  const PassOutcome outcome = bake(stub_settings(2), make_units(100, 40));
  ASSERT_FALSE(outcome.complete);
  EXPECT_NE(outcome.complete.error().message.find("the stub has no accelerator"), std::string::npos)
      << outcome.complete.error().message;
}

TEST(Farm, AMissingProgramIsAnErrorAtStart) {
  FarmSettings settings = stub_settings(1);
  settings.worker_program = "/nowhere/kiln-worker";
  const PassOutcome outcome = bake(settings, make_units(100, 4));
  ASSERT_FALSE(outcome.complete);
  EXPECT_NE(outcome.complete.error().message.find("/nowhere/kiln-worker"), std::string::npos);
}

TEST(Farm, TheErrorOfTheMergeEndsThePass) {
  const TestJob job;
  auto farm = start_farm(stub_settings(1), job);
  ASSERT_TRUE(farm);
  const auto full = [](const WorkUnit&, const UnitResult&) -> Status {
    return fail(ErrorKind::kNoSpace, "the spool is full");
  };
  const auto done = farm->job->run_pass(make_units(1, 4), 0, {full, {}, {}});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "the spool is full");
}

TEST(Farm, AtTheDeadlineThePassIsIncomplete) {
  const StubOptions stub("slow=100");
  const PassOutcome outcome = bake(stub_settings(1), make_units(100, 40), {}, SteadyClock().now_ms() + 500);
  ASSERT_TRUE(outcome.complete) << outcome.complete.error().message;
  EXPECT_FALSE(*outcome.complete);
  EXPECT_LT(outcome.moments.size(), 40u);
}

TEST(Farm, WorkersEndWithTheCoordinator) {
  const StubOptions stub("slow=50");
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t coordinator = ::fork();
  ASSERT_GE(coordinator, 0);
  if (coordinator == 0) {
    (void)bake(stub_settings(2), make_units(1, 1000), [&](size_t done) {
      if (done == 4) (void)!::write(ready[1], "x", 1);
    });
    ::_exit(0);
  }
  char byte;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  const std::vector<pid_t> workers = children_of(coordinator);
  EXPECT_EQ(workers.size(), 2u);
  ::kill(coordinator, SIGKILL);
  ::waitpid(coordinator, nullptr, 0);
  const SteadyClock clock;
  const auto any_alive = [&] {
    bool any = false;
    for (pid_t w : workers) any = any || alive(w);
    return any;
  };
  for (const int64_t limit = clock.now_ms() + 5000; any_alive() && clock.now_ms() < limit;)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_FALSE(any_alive());
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(Farm, NoWorkerIsLeftBehind) {
  (void)bake(stub_settings(3), make_units(100, 40));
  EXPECT_TRUE(children_of(::getpid()).empty());
}

}  // namespace
}  // namespace kiln

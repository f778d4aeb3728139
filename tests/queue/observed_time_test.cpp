// Time that ages are counted from, when clocks leap, stand, return, and coordinators restart.
#include "coordinator/farm/queue/observed_time.h"

#include "common/base/files.h"

namespace kiln::test {
namespace {

constexpr int64_t kHour = 3'600'000, kDay = 24 * kHour, kYear = 365 * kDay, kStart = 50 * kYear;

// A machine with its two clocks; `time` is the coordinator's.
struct Machine {
  int64_t wall = kStart, steady = 77;
  ObservedTime time{{}, 0, kStart, 77};
  void run(int64_t for_ms, int64_t step = kHour) {
    for (int64_t gone = 0; gone < for_ms; gone += step) {
      wall += step;
      steady += step;
      time.observe(wall, steady);
    }
  }
  void restart(int64_t off_ms) {
    wall += off_ms;
    steady = 5;  // it begins with the machine
    time = ObservedTime(time.record(), 0, wall, steady);
  }
};

TEST(ObservedTime, FollowsAClockThatGoesOn) {
  Machine m;
  m.run(40 * kDay);
  EXPECT_EQ(m.time.now_ms(), m.wall);
  m.restart(20 * kHour);
  EXPECT_EQ(m.time.now_ms(), m.wall);
  m.wall += 23 * kHour;  // by hand, while it runs
  m.run(kHour);
  EXPECT_EQ(m.time.now_ms(), m.wall);
  EXPECT_FALSE(m.time.doubted());
}

TEST(ObservedTime, ALeapCountsForNothingUntilItHasLastedADayOfRunning) {
  for (const bool at_a_start : {true, false}) {
    Machine m;
    m.run(kDay);
    const int64_t before = m.wall;
    if (at_a_start) {
      m.restart(2 * kYear);
    } else {
      m.wall += 2 * kYear;
      m.run(kHour);
    }
    EXPECT_TRUE(m.time.doubted());
    EXPECT_LE(m.time.now_ms(), before + kHour);
    m.run(20 * kHour);
    EXPECT_TRUE(m.time.doubted());
    EXPECT_LE(m.time.now_ms(), before + 21 * kHour);
    m.restart(10 * kHour);  // the doubt, and how long it has lasted, outlive the coordinator
    EXPECT_TRUE(m.time.doubted());
    m.run(3 * kHour);
    EXPECT_TRUE(m.time.doubted());
    m.run(kHour + (at_a_start ? 0 : kHour));
    EXPECT_FALSE(m.time.doubted());
    EXPECT_EQ(m.time.now_ms(), m.wall);
  }
}

TEST(ObservedTime, AClockThatLeapsAgainBeginsTheDayAnew) {
  Machine m;
  m.restart(2 * kYear);
  m.run(23 * kHour);
  m.wall += kHour;
  m.run(2 * kHour);
  EXPECT_TRUE(m.time.doubted());
  m.run(22 * kHour);
  EXPECT_TRUE(m.time.doubted());
  m.run(kHour);
  EXPECT_FALSE(m.time.doubted());
}

TEST(ObservedTime, AClockThatComesBackLeavesNothingBehind) {
  Machine m;
  m.restart(2 * kYear);
  m.run(kHour);
  m.wall -= 2 * kYear;
  m.run(kHour);
  EXPECT_FALSE(m.time.doubted());
  EXPECT_EQ(m.time.now_ms(), m.wall);
}

TEST(ObservedTime, NeverGoesBackAndGoesOnUnderAClockThatIsBehind) {
  Machine m;
  m.run(kDay);
  const int64_t before = m.time.now_ms();
  m.restart(-2 * kYear);
  EXPECT_EQ(m.time.now_ms(), before);
  m.run(5 * kDay);
  EXPECT_EQ(m.time.now_ms(), before + 5 * kDay);
  EXPECT_FALSE(m.time.doubted());
  m.restart(2 * kYear);
  EXPECT_EQ(m.time.now_ms(), m.wall);
}

TEST(ObservedTime, IsAcceptedByHand) {
  Machine m;
  m.restart(30 * kDay);
  EXPECT_TRUE(m.time.doubted());
  m.time.accept();
  EXPECT_FALSE(m.time.doubted());
  EXPECT_EQ(m.time.now_ms(), m.wall);
}

TEST(ObservedTime, WithoutARecordTheNewestJobIsTheMeasure) {
  EXPECT_FALSE(ObservedTime({}, 0, kStart, 0).doubted());
  EXPECT_FALSE(ObservedTime({}, kStart - kHour, kStart, 0).doubted());
  EXPECT_TRUE(ObservedTime({}, kStart - 2 * kYear, kStart, 0).doubted());
  const ObservedTime from_the_future({}, kStart + 2 * kYear, kStart, 0);
  EXPECT_FALSE(from_the_future.doubted());
  EXPECT_EQ(from_the_future.now_ms(), kStart);
}

TEST(ObservedTime, IsKeptInAFileThatMayBeDamaged) {
  const TempDir dir;
  EXPECT_EQ(read_clock(dir.path()), ClockRecord{});
  const ClockRecord record{kStart, kStart + kYear, kHour};
  ASSERT_TRUE(write_clock(dir.path(), record));
  EXPECT_EQ(read_clock(dir.path()), record);
  for (const char* damage :
       {"", "{", "[]", R"({"seen_ms": 1})", "{\"seen_ms\":-1,\"claimed_ms\":0,\"claimed_for_ms\":0}",
        "{\"seen_ms\":1e99,\"claimed_ms\":0,\"claimed_for_ms\":0}"}) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "clock", std::string_view(damage)));
    EXPECT_EQ(read_clock(dir.path()), ClockRecord{}) << damage;
  }
  std::filesystem::remove(dir.path() / "clock");
  std::filesystem::create_directory(dir.path() / "clock");
  EXPECT_EQ(read_clock(dir.path()), ClockRecord{}) << "a folder where the file should be";
  EXPECT_FALSE(take_acceptance(dir.path()));
  ASSERT_TRUE(accept_clock(dir.path(), kStart));
  EXPECT_EQ(take_acceptance(dir.path()), kStart);
  EXPECT_FALSE(take_acceptance(dir.path()));
  for (const char* damage : {"", "x", "-5", "99999999999999999999", "1152921504606846976"}) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "accept-clock", std::string_view(damage)));
    EXPECT_FALSE(take_acceptance(dir.path())) << damage;
  }
  std::filesystem::create_directories(dir.path() / "accept-clock" / "x");
  EXPECT_FALSE(take_acceptance(dir.path())) << "a folder where the file should be";
}

TEST(ObservedTime, IsWrittenAsADate) {
  EXPECT_EQ(utc_text(0), "1970-01-01 00:00 UTC");
  EXPECT_EQ(utc_text(1'700'000'000'000), "2023-11-14 22:13 UTC");
}

}  // namespace
}  // namespace kiln::test

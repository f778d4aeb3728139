#include "coordinator/bake/sampling/pace.h"

#include <chrono>
#include <limits>
#include <thread>

namespace kiln {
namespace {

void run_pass(BakePace& pace, double samples, double later) {
  pace.begin_pass(samples, later, 2);
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  pace.end_pass(64, 8, 0.01);
}

TEST(Pace, ThePassThatBeginsIsForetoldByTheLastOne) {
  BakePace pace(std::numeric_limits<double>::infinity());
  pace.begin_pass(1000, -1, 0);
  EXPECT_LT(pace.seconds_left(0), 0) << "of what is to come nothing is known";
  EXPECT_LT(pace.seconds_left(0.5), 0);
  pace.begin_pass(1000, 500, 1);
  EXPECT_LT(pace.seconds_left(0), 0) << "no pass has told the speed";
  run_pass(pace, 1000, 5000);
  pace.begin_pass(1e7, 5e7, 2);  // a minute at least
  const double foretold = pace.seconds_for(6e7, 3);
  EXPECT_NEAR(pace.seconds_left(0) / foretold, 1, 0.01);
  EXPECT_LT(pace.seconds_left(0.5), 0.5 * foretold) << "half a pass tells its own speed";
}

TEST(Pace, TheFirstResultsOfAPassDoNotOverturnWhatTheLastOneForetells) {
  BakePace pace(std::numeric_limits<double>::infinity());
  run_pass(pace, 1000, 5000);
  pace.begin_pass(1e7, 5e7, 2);
  const double foretold = pace.seconds_for(6e7, 3);
  EXPECT_GT(pace.seconds_left(0.025), 0.5 * foretold) << "at once, a fortieth of a pass";
  EXPECT_LT(pace.seconds_left(0.9), 0.15 * foretold) << "nine tenths of a pass";
}

}  // namespace
}  // namespace kiln

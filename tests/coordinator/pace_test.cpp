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
  pace.begin_pass(10, 5000, 2);
  EXPECT_GT(pace.seconds_left(0), 0);
  EXPECT_EQ(pace.seconds_left(0), pace.seconds_for(5010, 3));
  EXPECT_NE(pace.seconds_left(0.5), pace.seconds_for(5010, 3)) << "half a pass tells its own speed";
}

}  // namespace
}  // namespace kiln

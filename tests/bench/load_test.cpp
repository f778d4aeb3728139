// What farm_load prints about fairness, held to the stated target: 5 % of a user's share.
#include "tests/bench/share_error.h"

namespace kiln::bench {
namespace {

TEST(FarmShare, ThreadTimeIsDividedWithinFivePercent) {
  for (ShareCase c : share_cases()) {
    const ShareFigures f = measure_share(c);
    EXPECT_LT(f.worst_error, 0.05) << c.name << ": " << f.worst_user;
    EXPECT_GT(f.units, 10000u) << c.name;
  }
}

}  // namespace
}  // namespace kiln::bench

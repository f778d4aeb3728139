// Promises of the farm under every fault that can be simulated. A failing seed replays:
//   build/bin/farm_sim --first SEED --seeds 1 --trace
#include <cstdlib>

#include "tests/sim/world.h"

namespace kiln::sim {
namespace {

TEST(FarmSimulation, TwoHundredWorldsKeepThePromises) {
  const char* asked = std::getenv("KILN_SEEDS");
  const uint64_t seeds = asked ? std::strtoull(asked, nullptr, 10) : 200;
  WorldFigures sum;
  for (uint64_t seed = 1; seed <= seeds; ++seed) {
    World world(seed);
    const std::string broken = world.run();
    ASSERT_TRUE(broken.empty()) << "seed " << seed << ": " << broken;
    sum.kills += world.figures().kills;
    sum.restarts += world.figures().restarts;
    sum.lies += world.figures().lies;
    sum.quarantined += world.figures().quarantined;
    sum.rewinds += world.figures().rewinds;
    sum.refused_writes += world.figures().refused_writes;
    sum.skipped += world.figures().skipped;
    sum.rotten += world.figures().rotten;
    sum.leaps += world.figures().leaps;
    sum.torn += world.figures().torn;
    sum.cut_short += world.figures().cut_short;
  }
  if (seeds < 100) return;
  // The worlds are worth something only if the faults happen.
  EXPECT_GT(sum.kills, seeds);
  EXPECT_GT(sum.restarts, seeds / 2);
  EXPECT_GT(sum.lies, seeds / 4);
  EXPECT_GT(sum.quarantined, seeds / 10);
  EXPECT_GT(sum.rewinds, seeds / 100);
  EXPECT_GT(sum.refused_writes, seeds / 4);
  EXPECT_GT(sum.skipped, seeds / 20);
  EXPECT_GT(sum.rotten, seeds / 4);
  EXPECT_GT(sum.leaps, seeds);
  EXPECT_GT(sum.torn, seeds / 2);
  EXPECT_GT(sum.cut_short, seeds / 10);
}

}  // namespace
}  // namespace kiln::sim

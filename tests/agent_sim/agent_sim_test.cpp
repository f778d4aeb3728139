// Real agents and a real server under every fault that can be simulated. A failing seed replays:
//   build/bin/agent_sim --first SEED --seeds 1 --trace
#include <unistd.h>

#include <cstdlib>

#include "common/base/format.h"
#include "common/base/log.h"
#include "tests/agent_sim/world.h"

namespace kiln::sim {
namespace {

std::string folder() {
  return text("/dev/shm/kiln-agent-sim-test-{}", ::getpid());
}

TEST(AgentSimulation, ThreeHundredWorldsKeepThePromises) {
  log_setup("agent_sim_test", LogLevel::kOff);
  const char* asked = std::getenv("KILN_SEEDS");
  const uint64_t seeds = asked ? std::strtoull(asked, nullptr, 10) : 300;
  WorldFigures sum;
  for (uint64_t seed = 1; seed <= seeds; ++seed) {
    World world(seed, folder());
    const std::string broken = world.run();
    ASSERT_TRUE(broken.empty()) << "seed " << seed << ": " << broken;
    sum += world.figures();
  }
  if (seeds < 100) return;
  // The worlds are worth something only if the faults happen.
  EXPECT_GT(sum.kills, seeds / 2) << sum.words();
  EXPECT_GT(sum.restarts, seeds / 2);
  EXPECT_GT(sum.cuts, seeds);
  EXPECT_GT(sum.resent, seeds / 10);
  EXPECT_GT(sum.refused_writes, seeds / 10);
  EXPECT_GT(sum.lost_blocks, seeds / 20);
  EXPECT_GT(sum.rotten, seeds / 20);
  EXPECT_GT(sum.rewinds, 0u);
  EXPECT_GT(sum.hung, seeds / 20);
  EXPECT_GT(sum.failed_jobs, seeds / 40);
}

TEST(AgentSimulation, ASeedDecidesEverything) {
  log_setup("agent_sim_test", LogLevel::kOff);
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    std::string words[2];
    for (std::string& w : words) {
      World world(seed, folder());
      EXPECT_EQ(world.run(), "");
      w = world.figures().words();
    }
    EXPECT_EQ(words[0], words[1]) << seed;
  }
}

}  // namespace
}  // namespace kiln::sim

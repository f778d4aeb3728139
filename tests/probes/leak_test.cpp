// Walls keep light from the room behind them.
#include "tests/probes/two_rooms.h"

namespace kiln::test {
namespace {

constexpr int kOffsets = 16, kPoints = 1500;
constexpr uint32_t kSamples = 128;

TEST(ProbeLeaks, AWallOf20CentimetresHoldsOnAGridOfAMetre) {
  const Leak leak = leak_of(0.2f, 1, kOffsets, kPoints, kSamples, {});
  EXPECT_LT(leak.mean, 0.001) << leak.p99;
  EXPECT_LT(leak.p99, 0.01);
}

// So the test above can fail.
TEST(ProbeLeaks, WithoutVisibilityItLeaks) {
  ProbeQuery blind;
  blind.visibility = false;
  EXPECT_GT(leak_of(0.2f, 1, kOffsets, kPoints, kSamples, blind).mean, 0.03);
}

}  // namespace
}  // namespace kiln::test

// One scene of each hostile family (tests/hostile/scenes.py) is planned: refused with a sentence or laid out,
// within 2 GiB. `python3 tests/hostile/run.py` bakes 200 of them, with a limit of time too.
#include "common/base/format.h"

namespace kiln {
namespace {

TEST(Hostile, AreRefusedOrLaidOut) {
  const test::CommandResult result = test::run_command(
      text("python3 '{}/tests/hostile/run.py' --bin '{}/bin' --verb plan --scenes 40 --seconds 0 2>&1",
           test::source_dir().string(), test::binary_dir().string()));
  EXPECT_EQ(result.exit_status, 0) << result.output;
}

}  // namespace
}  // namespace kiln

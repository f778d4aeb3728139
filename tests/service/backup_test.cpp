// A backup that is made while jobs are baked is a folder from which a coordinator goes on.
#include <fstream>

#include "common/base/format.h"
#include "coordinator/cli/doctor_steps.h"
#include "tests/bake/scene_gltf.h"
#include "tests/queue/samples.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

class Backup : public testing::Test {
 protected:
  Backup() {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  CommandResult back_up(const fs::path& folder) {
    return run_kiln(dir_.path(), text("backup --data data -o {}", folder.string()));
  }
  TempDir dir_;
  Snapshot snapshot_;
};

TEST_F(Backup, OfARunningCoordinatorHasItsJobsResultsAndUnits) {
  const fs::path copy = dir_.path() / "copy";
  std::map<std::string, std::string> results;
  uint64_t done = 0, begun = 0;
  {
    ServiceHost host(dir_.path() / "data");
    const auto client = host.client();
    done = submit(*client, snapshot_, "a");
    ASSERT_EQ(wait_for_state(*client, done, "done failed"), "done");
    results = fetched(*client, done, dir_.path() / "out");
    Snapshot longer = snapshot_;
    EXPECT_TRUE(set_option(longer.settings, "tile-texels", "1", "test"));
    begun = submit(*client, longer, "b");
    ASSERT_EQ(wait_for_state(*client, begun, "baking finishing done"), "baking");
    const CommandResult made = back_up(copy);
    ASSERT_EQ(made.exit_status, 0) << made.output;
    EXPECT_NE(made.output.find("2 jobs"), std::string::npos) << made.output;
    const CommandResult again = back_up(copy);
    EXPECT_NE(again.exit_status, 0);
    EXPECT_NE(again.output.find("is not empty"), std::string::npos) << again.output;
    EXPECT_FALSE(fs::exists(host.settings.data / "work/backup"));
    EXPECT_EQ(fs::status(copy).permissions(), fs::perms::owner_all);
  }
  const DoctorStep whole = look_at_backup(copy.string());
  EXPECT_TRUE(whole.good) << whole.finding;
  EXPECT_FALSE(look_at_backup((dir_.path() / "data").string()).good);
  fs::remove_all(dir_.path() / "data");
  ServiceHost host(copy);
  const auto client = host.client();
  EXPECT_EQ(fetched(*client, done, dir_.path() / "out2"), results);
  EXPECT_EQ(wait_for_state(*client, begun, "done failed"), "done");
}

TEST_F(Backup, OfAFolderThatNobodyUsesAndItsDamageIsFound) {
  uint64_t id = 0;
  {
    ServiceHost host(dir_.path() / "data", 0);
    const auto client = host.client();
    id = submit(*client, snapshot_, "a");
    ASSERT_EQ(wait_for_state(*client, id, "baking"), "baking");
  }
  const fs::path copy = dir_.path() / "copy";
  ASSERT_EQ(back_up(copy).exit_status, 0);
  EXPECT_TRUE(look_at_backup(copy.string()).good);
  const std::string hex = snapshot_.files[0].digest.hex();
  flip_bit(copy / "blobs" / hex.substr(0, 2) / hex);
  const DoctorStep damaged = look_at_backup(copy.string());
  EXPECT_FALSE(damaged.good);
  EXPECT_NE(damaged.finding.find("input room.glb of job 1 is damaged"), std::string::npos) << damaged.finding;
  fs::remove(copy / "backup.json");
  EXPECT_FALSE(look_at_backup(copy.string()).good);
  EXPECT_NE(back_up("/proc/nowhere").exit_status, 0);
}

}  // namespace
}  // namespace kiln::test

// Scenes are prepared in a process of their own first: whatever becomes of it, the coordinator goes on.
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/service/turn.h"
#include "tests/bake/scene_gltf.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

class Preparing : public testing::Test {
 protected:
  Preparing() : host_(dir_.path() / "data", 0) {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  // In place of `kiln check-scene`.
  void check_with(const std::string& script) {
    const fs::path program = dir_.path() / "check.sh";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    ASSERT_EQ(::chmod(program.c_str(), 0755), 0);
    host_.settings.check_program = program.string();
    host_.restart();
  }
  void check_with_kiln() {
    host_.settings.check_program = (binary_dir() / "bin/kiln").string();
    host_.restart();
  }
  // Submits the room and waits; the reason of its failure.
  std::string failure() {
    const auto client = host_.client();
    const uint64_t id = submit(*client, snapshot_, text("key {}", ++jobs_));
    EXPECT_EQ(wait_for_state(*client, id, "failed baking"), "failed");
    EXPECT_EQ(host_.service->job(id)->preparations, 1u) << "it is not tried again";
    EXPECT_FALSE(fs::exists(host_.settings.data / "work" / std::to_string(id)));
    return host_.service->job(id)->reason;
  }
  static bool says(const std::string& reason, const std::string& part) {
    return reason.find(part) != std::string::npos;
  }
  TempDir dir_;
  ServiceHost host_;
  Snapshot snapshot_;
  int jobs_ = 0;
};

TEST_F(Preparing, AGoodSceneIsBaked) {
  check_with_kiln();
  const auto client = host_.client();
  Snapshot with_sun = snapshot_;
  for (const char* sun : {"0,1,0:1,1,1", "1,1,0:2,2,2"})
    ASSERT_TRUE(set_option(with_sun.settings, "sun", sun, "test"));
  const uint64_t id = submit(*client, with_sun, "k");
  EXPECT_EQ(wait_for_state(*client, id, "baking failed"), "baking") << host_.service->job(id)->reason;
}

TEST_F(Preparing, ADeathOfTheChildFailsTheJobAlone) {
  check_with("kill -SEGV $$");
  EXPECT_PRED2(says, failure(),
               "room.glb: the process that imports it and lays out its lightmap ended with signal 11");
  check_with("echo 'kiln: it is no scene' >&2; exit 2");
  EXPECT_EQ(failure(), "it is no scene");
  check_with("exit 9");
  EXPECT_PRED2(says, failure(), "takes more than the 4096 MiB of memory that a job may take");
  check_with("exit 0");
  const auto client = host_.client();
  const uint64_t id = submit(*client, snapshot_, "good");
  EXPECT_EQ(wait_for_state(*client, id, "baking failed"), "baking") << "the coordinator goes on";
}

TEST_F(Preparing, MemoryAndTimeAreLimited) {
  host_.settings.prepare.memory_bytes = uint64_t{200} << 20;
  check_with("exec python3 -c 'import time; held = bytearray(500 << 20); time.sleep(1000)'");
  EXPECT_PRED2(says, failure(), "takes more than the 200 MiB of memory that a job may take");
  host_.settings.prepare = {uint64_t{1} << 30, 1};
  check_with("exec sleep 1000");
  EXPECT_PRED2(says, failure(), "--prepare-time");
}

// The child limits itself too: an allocation that is too large fails before its pages are touched.
TEST_F(Preparing, TheChildEndsWithoutMemory) {
  std::string gltf = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{}";
  for (int i = 1; i < 700'000; ++i) gltf += ",{}";
  ASSERT_TRUE(write_file_atomic(dir_.path() / "nodes.gltf", gltf + "]}"));
  snapshot_ = *take_snapshot(dir_.path() / "nodes.gltf", quick_settings());
  host_.settings.prepare.memory_bytes = uint64_t{96} << 20;
  check_with_kiln();
  EXPECT_PRED2(says, failure(), "takes more than the 96 MiB of memory");
}

TEST_F(Preparing, CancelKillsTheChildAtOnce) {
  const fs::path pid_file = dir_.path() / "pid";
  check_with(text("echo $$ > {}.new; mv {}.new {}; exec sleep 1000", pid_file.string(), pid_file.string(),
                  pid_file.string()));
  const auto client = host_.client();
  const uint64_t id = submit(*client, snapshot_, "k");
  pid_t child = 0;
  for (int i = 0; i < 1200 && child == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    std::ifstream(pid_file) >> child;
  }
  ASSERT_NE(child, 0);
  EXPECT_EQ(state_of(*client, id), "preparing");
  ask(*client, "cancel", text("{{\"id\":{}}}", id));
  EXPECT_EQ(wait_for_state(*client, id, "cancelled failed baking"), "cancelled");
  EXPECT_NE(::kill(child, 0), 0) << "it sleeps on";
}

TEST_F(Preparing, TheServiceStopsWithAChild) {
  check_with("exec sleep 1000");
  const auto client = host_.client();
  const uint64_t id = submit(*client, snapshot_, "k");
  ASSERT_EQ(wait_for_state(*client, id, "preparing"), "preparing");
  EXPECT_TRUE(host_.service->stop(std::chrono::minutes(1)));
  host_.restart();
  EXPECT_NE(host_.service->job(id)->state, JobState::kFailed);
}

TEST(Finishing, PausesGrowAndEnd) {
  JobRecord job;
  job.preparations = 9;
  EXPECT_EQ(finishing_pause_ms(job), 0);
  int64_t last = -1;
  for (uint32_t n = 0; n < 10; ++n) {
    job.preparations = kFinishings + n;
    EXPECT_GT(finishing_pause_ms(job), last);
    EXPECT_FALSE(is_to_be_kept(job));
    last = finishing_pause_ms(job);
  }
  job.preparations = ~0u;
  EXPECT_EQ(finishing_pause_ms(job), 300'000);
  EXPECT_TRUE(is_to_be_kept(job));
}

// Deaths while all units are there never fail a job: it is kept, and `kiln retry` finishes it.
TEST_F(Preparing, AJobThatIsFinishingIsKept) {
  const auto client = host_.client();
  const uint64_t id = submit(*client, snapshot_, "k");
  ASSERT_EQ(wait_for_state(*client, id, "baking"), "baking");
  host_.service.reset();
  {
    auto store = Store::open(host_.settings.data, {});
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->change(id, [](JobRecord& job) -> Status {
      job.state = JobState::kQueued;
      job.preparations = kFinishings + 10;
      job.reason = "to finish it failed and is tried again: no hands";
      return {};
    }));
  }
  host_.restart();
  const auto again = host_.client();
  for (int i = 0; i < 1200 && !host_.service->job(id)->paused; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(state_of(*again, id), "queued");
  EXPECT_PRED2(says, host_.service->job(id)->reason, "all its units are kept, and `kiln retry` finishes it");
  EXPECT_PRED2(says, host_.service->job(id)->reason, "no hands");
  ask(*again, "retry", text("{{\"id\":{}}}", id));
  EXPECT_EQ(wait_for_state(*again, id, "baking failed"), "baking");
  EXPECT_GE(host_.service->job(id)->preparations, kFinishings) << "its units are still all there";
}

}  // namespace
}  // namespace kiln::test

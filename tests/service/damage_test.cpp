// Bytes that rot on the coordinator's disk: noticed when they are read, never baked and never given out.
#include <thread>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/cli/doctor_steps.h"
#include "tests/bake/scene_gltf.h"
#include "tests/queue/samples.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

class ServiceDamage : public testing::Test {
 protected:
  ServiceDamage() {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  fs::path blob(const std::string& hex) const {
    return dir_.path() / "data" / "blobs" / hex.substr(0, 2) / hex;
  }
  TempDir dir_;
  Snapshot snapshot_;
};

TEST_F(ServiceDamage, ADamagedInputIsAskedForInTheSameSubmission) {
  ServiceHost host(dir_.path() / "data", 0);
  const auto client = host.client();
  const std::string hex = snapshot_.files[0].digest.hex();
  ASSERT_EQ(wait_for_state(*client, submit(*client, snapshot_, "a"), "baking failed"), "baking");
  for (int truncated = 0; truncated < 2; ++truncated) {
    if (truncated)
      fs::resize_file(blob(hex), 100);
    else
      flip_bit(blob(hex));
    const JsonValue missing = ask(*client, "submit", submission(snapshot_, text("b{}", truncated)));
    ASSERT_EQ(missing.find("missing")->items.size(), 1u);
    EXPECT_EQ(missing.find("missing")->items[0].text, hex);
    ASSERT_NE(submit(*client, snapshot_, text("b{}", truncated)), 0u);
    EXPECT_EQ(sha256(*read_file(blob(hex))).hex(), hex);
    EXPECT_TRUE(fs::exists(dir_.path() / "data/blobs/damaged" / hex));
  }
}

TEST_F(ServiceDamage, AJobWhoseInputRottedInTheQueueFailsAndSaysWhatToDo) {
  ServiceHost host(dir_.path() / "data", 0, 1);
  const auto client = host.client();
  const std::string hex = snapshot_.files[0].digest.hex();
  const uint64_t first = submit(*client, snapshot_, "a"), second = submit(*client, snapshot_, "b");
  ASSERT_EQ(wait_for_state(*client, first, "baking failed"), "baking");
  flip_bit(blob(hex));
  ask(*client, "cancel", text("{{\"id\":{}}}", first));
  ASSERT_EQ(wait_for_state(*client, second, "baking failed"), "failed");
  const std::string reason = host.service->job(second)->reason;
  for (const std::string& words : {std::string("room.glb"), hex, std::string("submit")})
    EXPECT_NE(reason.find(words), std::string::npos) << reason;
  // Whoever has the file sends it again, and the job that failed can be tried again.
  const uint64_t third = submit(*client, snapshot_, "c");
  ASSERT_EQ(wait_for_state(*client, third, "baking failed"), "baking");
  ask(*client, "cancel", text("{{\"id\":{}}}", third));
  ask(*client, "retry", text("{{\"id\":{}}}", second));
  EXPECT_EQ(wait_for_state(*client, second, "baking failed"), "baking");
}

TEST_F(ServiceDamage, ADamagedResultIsBakedAgain) {
  ServiceHost host(dir_.path() / "data");
  const auto client = host.client();
  const uint64_t id = submit(*client, snapshot_, "a");
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  auto before = fetched(*client, id, dir_.path() / "before");
  const auto results = host.service->job(id)->results;
  const auto master = std::find_if(results.begin(), results.end(),
                                   [](const FileRecord& file) { return file.path.ends_with(".exr"); });
  ASSERT_NE(master, results.end());
  for (const bool gone : {false, true}) {
    if (gone)
      fs::remove(blob(master->digest.hex()));
    else
      flip_bit(blob(master->digest.hex()));
    const Status damaged =
        client->download({id, master->path, master->digest, master->size}, dir_.path() / "damaged.exr", {});
    ASSERT_FALSE(damaged);
    for (const std::string& words : {master->path, text("job {}", id), std::string("baked again")})
      EXPECT_NE(damaged.error().message.find(words), std::string::npos) << damaged.error().message;
    EXPECT_FALSE(fs::exists(dir_.path() / "damaged.exr"));
    ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
    const auto after = fetched(*client, id, dir_.path() / (gone ? "after-gone" : "after"));
    EXPECT_EQ(after.at(master->path), before.at(master->path));
    EXPECT_EQ(after.size(), before.size());
  }
  size_t said = 0;
  for (const JobEvent& event : host.service->events_of(id))
    said += event.text.find("baked again") != event.text.npos;
  EXPECT_EQ(said, 2u);  // once each
}

// The bake gives the same bytes, so one job is enough for all that published them.
TEST_F(ServiceDamage, OneJobBakesAgainWhatSeveralPublished) {
  ServiceHost host(dir_.path() / "data");
  const auto client = host.client();
  std::vector<uint64_t> ids;
  for (const char* key : {"a", "b", "c"}) {
    ids.push_back(submit(*client, snapshot_, key));
    ASSERT_EQ(wait_for_state(*client, ids.back(), "done failed"), "done");
  }
  const auto results = host.service->job(ids[0])->results;
  const auto master = std::find_if(results.begin(), results.end(),
                                   [](const FileRecord& file) { return file.path.ends_with(".exr"); });
  ASSERT_NE(master, results.end());
  const auto download = [&](uint64_t id) {
    fs::remove(dir_.path() / "fetched.exr");
    return client->download({id, master->path, master->digest, master->size}, dir_.path() / "fetched.exr",
                            {});
  };
  flip_bit(blob(master->digest.hex()));
  const Status second = download(ids[1]);
  ASSERT_FALSE(second);
  ask(*client, "pause", text("{{\"id\":{}}}", ids[1]));  // until we have looked
  const Status first = download(ids[0]);
  ASSERT_FALSE(first);
  EXPECT_EQ(second.error().message.find("which has the same file"), std::string::npos)
      << second.error().message;
  EXPECT_NE(first.error().message.find(text("job {}, which has the same file, is baked again", ids[1])),
            std::string::npos)
      << first.error().message;
  EXPECT_EQ(state_of(*client, ids[0]), "done");
  EXPECT_EQ(state_of(*client, ids[2]), "done");
  ask(*client, "resume", text("{{\"id\":{}}}", ids[1]));
  ASSERT_EQ(wait_for_state(*client, ids[1], "done failed"), "done");
  for (const uint64_t id : ids) EXPECT_TRUE(download(id));
}

TEST_F(ServiceDamage, RotIsFoundBeforeAnybodyAsks) {
  ServiceHost host(dir_.path() / "data");
  uint64_t id = 0;
  std::map<std::string, std::string> before;
  {
    const auto client = host.client();
    id = submit(*client, snapshot_, "a");
    ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
    before = fetched(*client, id, dir_.path() / "before");
  }
  const std::string master = "charts.json";
  ASSERT_TRUE(before.count(master));
  host.service.reset();
  flip_bit(blob(before.at(master)));
  const DoctorStep step = look_at_store(host.settings.data.string());
  EXPECT_FALSE(step.good);
  EXPECT_NE(step.finding.find(text("result {} of job {} is damaged", master, id)), std::string::npos)
      << step.finding;
  fs::rename(dir_.path() / "data/blobs/damaged" / before.at(master), blob(before.at(master)));
  host.settings.scrub_mib_s = 1000;
  host.restart();
  const auto client = host.client();
  bool again = false;  // nobody fetches: the scrubber finds it
  for (int i = 0; i < 600 && !again; ++i) {
    for (const JobEvent& event : host.service->events_of(id))
      again = again || event.text.find("baked again") != event.text.npos;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ASSERT_TRUE(again);
  EXPECT_EQ(host.service->verified().damaged, 1u);
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  EXPECT_EQ(fetched(*client, id, dir_.path() / "after").at(master), before.at(master));
  host.service.reset();
  EXPECT_TRUE(look_at_store(host.settings.data.string()).good);
}

}  // namespace
}  // namespace kiln::test

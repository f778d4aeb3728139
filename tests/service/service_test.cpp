// Jobs from submission to their fetched results, with a real worker.
#include <sys/mount.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/service/turn.h"
#include "tests/bake/scene_gltf.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

class ServiceJobs : public testing::Test {
 protected:
  ServiceJobs() {
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  Snapshot with(const std::string& name, const std::string& value) const {
    Snapshot other = snapshot_;
    EXPECT_TRUE(set_option(other.settings, name, value, "test"));
    return other;
  }
  // Long enough to be met while it is baked.
  Snapshot long_job() const {
    Snapshot other = with("max-samples", "200000");
    EXPECT_TRUE(set_option(other.settings, "min-samples", "200000", "test"));
    return other;
  }
  std::map<std::string, std::string> local_bake(uint64_t* black = nullptr) {
    BakeRequest request;
    request.scene = dir_.path() / "room.glb";
    request.output = dir_.path() / "local";
    request.settings = snapshot_.settings;
    request.worker_program = binary_dir() / "bin/kiln-worker";
    const auto report = run_bake(request, [](const BakeProgress&) {});
    EXPECT_TRUE(report) << report.error().message;
    if (black) *black = report->atlas.collapsed[kUnlit].charts;
    std::map<std::string, std::string> masters;
    for (const OutputFile& f : report->outputs)
      if (f.master) masters[f.name] = f.digest.hex();
    return masters;
  }
  void expect_masters(const std::map<std::string, std::string>& got) {
    const auto expected = local_bake();
    EXPECT_GE(expected.size(), 5u);
    for (const auto& [name, digest] : expected) {
      ASSERT_TRUE(got.count(name)) << name;
      EXPECT_EQ(got.at(name), digest) << name;
    }
  }
  TempDir dir_;
  Snapshot snapshot_;
};

TEST_F(ServiceJobs, GivesTheBytesOfALocalBake) {
  ServiceHost host(dir_.path() / "data");
  const auto client = host.client("submit.token");
  ASSERT_TRUE(client);
  EXPECT_EQ(client->role(), "submit");
  const uint64_t id = submit(*client, snapshot_, "k1");
  ASSERT_NE(id, 0u);
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  expect_masters(fetched(*client, id, dir_.path() / "out"));
  // The same question again is the same job; another key is another, whose files are there already.
  EXPECT_EQ(submit(*client, snapshot_, "k1"), id);
  EXPECT_EQ(ask(*client, "submit", submission(snapshot_, "k2")).find("missing")->items.size(), 0u);
  // A half that an earlier try left is gone on with; a damaged one is not taken.
  const auto files = ask(*client, "fetch", text("{{\"id\":{}}}", id));
  const JsonValue& f = files.find("files")->items[0];
  const std::string name = f.find("path")->text, hex = f.find("digest")->text;
  const ServiceClient::Wanted wanted{id, name, *Digest::from_hex(hex), f.find("size")->whole};
  const auto whole = read_file(dir_.path() / "out" / name);
  fs::create_directories(dir_.path() / "half");
  const fs::path part = dir_.path() / "half" / text(".{}.{}.part", name, hex.substr(0, 16));
  std::ofstream(part, std::ios::binary).write(reinterpret_cast<const char*>(whole->data()), 100);
  uint64_t first = 0;
  ASSERT_TRUE(client->download(wanted, dir_.path() / "half" / name, [&](uint64_t done, uint64_t) {
    if (!first) first = done;
  }));
  EXPECT_EQ(first, 100u);
  fs::remove(dir_.path() / "half" / name);
  std::ofstream(part, std::ios::binary) << "not what was sent";
  EXPECT_FALSE(client->download(wanted, dir_.path() / "half" / name, {}));
  EXPECT_FALSE(fs::exists(dir_.path() / "half" / name));
}

TEST_F(ServiceJobs, GoOnAfterARestart) {
  ServiceHost host(dir_.path() / "data");
  uint64_t id = 0;
  {
    const auto client = host.client();
    id = submit(*client, with("tile-texels", "1"), "k");
    ASSERT_EQ(wait_for_state(*client, id, "baking finishing done"), "baking");
  }
  host.restart();
  const auto client = host.client();
  EXPECT_NE(state_of(*client, id), "failed");
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  expect_masters(fetched(*client, id, dir_.path() / "out"));
  // Stopped in order is not an attempt that died.
  EXPECT_LE(host.service->job(id)->preparations % kFinishings, 1u);
  EXPECT_FALSE(fs::exists(host.settings.data / "work" / std::to_string(id)));
  EXPECT_FALSE(fs::exists(host.settings.data / "spool" / std::to_string(id)));
}

TEST_F(ServiceJobs, WithTwoPassesGiveTheBytesOfALocalBakeAcrossARestart) {
  // Two layouts under one job: what the farm has kept of the one must not be taken for the other's.
  Scene scene = small_room();
  for (size_t i = 0; i < 6; ++i) {  // the walls again, without a lamp
    scene.instances.push_back(scene.instances[i]);
    scene.instances.back().to_world = Mat4x3(Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(9, 0, 0));
  }
  write_scene_glb(scene, dir_.path() / "room.glb");
  snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  snapshot_ = with("two-pass", "on");
  snapshot_ = with("min-samples", "32");  // units of both layouts begin with the same samples
  ServiceHost host(dir_.path() / "data");
  uint64_t id = 0;
  {
    const auto client = host.client();
    id = submit(*client, with("tile-texels", "1"), "k");
    ASSERT_EQ(wait_for_state(*client, id, "baking finishing done"), "baking");
  }
  host.restart();
  const auto client = host.client();
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  uint64_t black = 0;
  const auto expected = local_bake(&black), got = fetched(*client, id, dir_.path() / "out");
  EXPECT_GE(black, 2u) << "the scene does not test anything";
  for (const auto& [name, digest] : expected) EXPECT_EQ(got.at(name), digest) << name;
}

TEST_F(ServiceJobs, PauseCancelRetryAndThoseThatWait) {
  ServiceHost host(dir_.path() / "data", 1, 1);
  const auto client = host.client();
  const uint64_t first = submit(*client, long_job(), "a");
  ASSERT_EQ(wait_for_state(*client, first, "baking"), "baking");
  const uint64_t second = submit(*client, snapshot_, "b", text(",\"after\":[{}]", first));
  const uint64_t third = submit(*client, snapshot_, "c", ",\"priority\":5");
  EXPECT_EQ(state_of(*client, second), "waiting");
  EXPECT_EQ(state_of(*client, third), "queued");  // one at a time
  const std::string id = text("{{\"id\":{}}}", first);
  ask(*client, "pause", id);
  EXPECT_TRUE(ask(*client, "job", id).find("paused")->flag);
  ask(*client, "resume", id);
  EXPECT_FALSE(ask(*client, "job", id).find("paused")->flag);
  ask(*client, "priority", text("{{\"id\":{},\"priority\":-3}}", first));
  EXPECT_EQ(host.service->job(first)->priority, -3);
  const JsonValue why = ask(*client, "why", text("{{\"job\":{}}}", second));
  EXPECT_NE(why.find("why")->items.at(0).text.find(text("waits for job {}", first)), std::string::npos);
  ask(*client, "cancel", id);
  ASSERT_EQ(wait_for_state(*client, first, "cancelled"), "cancelled");
  ASSERT_EQ(wait_for_state(*client, second, "failed"), "failed");
  EXPECT_NE(host.service->job(second)->reason.find("cancelled"), std::string::npos);
  EXPECT_NE(ask_error(*client, "cancel", id).find("nothing is left to cancel"), std::string::npos);
  EXPECT_NE(ask_error(*client, "fetch", id).find("cancelled"), std::string::npos);
  ASSERT_EQ(wait_for_state(*client, third, "done failed"), "done");
  EXPECT_NE(
      ask_error(*client, "retry", text("{{\"id\":{}}}", third)).find("only failed, cancelled and tainted"),
      std::string::npos);
  ask(*client, "retry", id);
  ASSERT_EQ(wait_for_state(*client, first, "baking"), "baking");
  ask(*client, "cancel", id);
  ASSERT_EQ(wait_for_state(*client, first, "cancelled"), "cancelled");
  ask(*client, "forget", text("{{\"id\":{}}}", second));
  EXPECT_NE(ask_error(*client, "job", text("{{\"id\":{}}}", second)).find("there is no job"),
            std::string::npos);
}

TEST_F(ServiceJobs, AreGivenUpWhenTheyBringTheCoordinatorDown) {
  ServiceHost host(dir_.path() / "data", 0);
  const auto client = host.client();
  const uint64_t id = submit(*client, snapshot_, "k");
  ASSERT_EQ(wait_for_state(*client, id, "baking"), "baking");
  host.service.reset();
  {
    auto store = Store::open(host.settings.data, {});
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->change(id, [](JobRecord& job) -> Status {
      job.state = JobState::kPreparing;
      job.preparations = 10;
      return {};
    }));
  }
  host.restart();
  const auto again = host.client();
  ASSERT_EQ(wait_for_state(*again, id, "failed"), "failed");
  EXPECT_EQ(host.service->job(id)->reason, "the coordinator died ten times in a row while preparing it");
  ask(*again, "retry", text("{{\"id\":{}}}", id));
  EXPECT_EQ(wait_for_state(*again, id, "baking"), "baking");
}

TEST_F(ServiceJobs, HoldWhileTheDiskIsFull) {
  const fs::path small = dir_.path() / "small";
  fs::create_directories(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=24m") != 0)
    GTEST_SKIP() << "mounting a small file system needs rights";
  struct Unmount {
    fs::path path;
    ~Unmount() { ::umount2(path.c_str(), MNT_DETACH); }
  } const unmount{small};
  // The whole data folder is there but the blobs, which want a gigabyte free.
  fs::create_directories(dir_.path() / "blobs");
  fs::create_directory_symlink(dir_.path() / "blobs", small / "blobs");
  {
    ServiceHost host(small);
    const auto client = host.client();
    const uint64_t id = submit(*client, with("tile-texels", "1"), "k");
    ASSERT_NE(id, 0u);
    ASSERT_EQ(wait_for_state(*client, id, "baking"), "baking");
    {
      std::ofstream filler(small / "filler", std::ios::binary);
      const std::string block(64 << 10, 'x');
      while (filler << block << std::flush) {
      }
    }
    std::string held;
    for (int i = 0; i < 400 && held.empty(); ++i) {
      held = host.service->source().health().held_for;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    EXPECT_FALSE(held.empty());
    EXPECT_NE(ask(*client, "job", text("{{\"id\":{}}}", id)).find("reason")->text.find("cannot be written"),
              std::string::npos);
    fs::remove(small / "filler");
    ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done") << host.service->job(id)->reason;
    EXPECT_EQ(host.service->source().health().held_for, "");
    expect_masters(fetched(*client, id, dir_.path() / "out"));
  }
}

TEST_F(ServiceJobs, AreListedAndFetchedFromADiskThatIsFullAtTheStart) {
  const fs::path small = dir_.path() / "small";
  fs::create_directories(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=40m") != 0)
    GTEST_SKIP() << "mounting a small file system needs rights";
  struct Unmount {
    fs::path path;
    ~Unmount() { ::umount2(path.c_str(), MNT_DETACH); }
  } const unmount{small};
  fs::create_directories(dir_.path() / "blobs");
  fs::create_directory_symlink(dir_.path() / "blobs", small / "blobs");
  ServiceHost host(small);
  uint64_t done = 0, begun = 0;
  {
    const auto client = host.client();
    done = submit(*client, with("tile-texels", "1"), "a");
    ASSERT_EQ(wait_for_state(*client, done, "done failed"), "done");
    begun = submit(*client, with("tile-texels", "2"), "b");
    ASSERT_EQ(wait_for_state(*client, begun, "baking finishing done"), "baking");
  }
  host.service.reset();
  {
    auto store = Store::open(small, {});  // as a killed coordinator leaves it
    ASSERT_TRUE((*store)->change(begun, [](JobRecord& job) -> Status {
      job.state = JobState::kBaking;
      return {};
    }));
  }
  std::ofstream filler(small / "filler", std::ios::binary);
  for (const size_t piece : {64u << 10, 4096u, 1u}) {
    const std::string block(piece, 'x');
    filler.clear();
    while (filler << block << std::flush) {
    }
  }
  filler.close();
  host.restart();
  const auto client = host.client();
  ASSERT_TRUE(client);
  expect_masters(fetched(*client, done, dir_.path() / "out"));
  EXPECT_FALSE(host.service->source().health().held_for.empty());
  EXPECT_NE(ask(*client, "job", text("{{\"id\":{}}}", begun)).find("reason")->text.find("cannot be written"),
            std::string::npos);
  EXPECT_NE(ask_error(*client, "submit", submission(snapshot_, "c")).find("full"), std::string::npos);
  fs::remove(small / "filler");
  ASSERT_EQ(wait_for_state(*client, begun, "done failed"), "done") << host.service->job(begun)->reason;
  EXPECT_EQ(host.service->source().health().held_for, "");
}

TEST_F(ServiceJobs, SurviveKillsOfTheCoordinator) {
  const CommandResult r = run_command(
      text("python3 {}/tests/service/kill_coordinator.py --bin {}/bin --kills 20 --seed 1 --scene {} 2>&1",
           source_dir().string(), binary_dir().string(), (dir_.path() / "room.glb").string()));
  EXPECT_EQ(r.exit_status, 0) << r.output;
}

}  // namespace
}  // namespace kiln::test

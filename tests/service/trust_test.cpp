// What is known of a job's results after it has ended, and what becomes of it when a worker turns out to lie.
#include <fstream>
#include <future>

#include "common/base/format.h"
#include "tests/bake/scene_gltf.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {

std::string text_in(const JsonValue& document, const std::string& name) {
  const JsonValue* value = document.find(name);
  return value ? value->text : "";
}

TEST(ServiceTrust, WhatWasCheckedIsToldAfterTheEndAndSuspectJobsAreBakedAgain) {
  const TempDir dir;
  write_scene_glb(small_room(), dir.path() / "room.glb");
  const Snapshot snapshot = *take_snapshot(dir.path() / "room.glb", quick_settings());
  ServiceHost host(dir.path() / "data");
  auto client = host.client();
  const uint64_t id = submit(*client, snapshot, "a");
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  const std::string job = text("{{\"id\":{}}}", id);
  const std::string checked = text_in(ask(*client, "job", job), "verification");
  EXPECT_NE(checked.find("unit results"), std::string::npos) << checked;
  EXPECT_EQ(text_in(ask(*client, "fetch", job), "verification"), checked);
  EXPECT_GT(host.service->job(id)->units_done, 0u);
  const std::string liar = text_in(ask(*client, "workers", "{}").find("workers")->items.at(0), "identity");
  const auto before = fetched(*client, id, dir.path() / "before");
  EXPECT_NE(ask_error(*client, "retry", job).find("only failed, cancelled and tainted"), std::string::npos);

  // Found out by another job, say.
  client.reset();
  host.service.reset();
  {
    auto store = Store::open(host.settings.data, {});
    ASSERT_TRUE(store) << store.error().message;
    std::promise<Status> stored;
    (*store)->quarantine(liar, "it lied", 1, [&](Status s) { stored.set_value(std::move(s)); });
    ASSERT_TRUE(stored.get_future().get());
  }
  host.restart();
  client = host.client();
  EXPECT_NE(text_in(ask(*client, "job", job), "taint").find(liar), std::string::npos);
  const JsonValue workers = ask(*client, "workers", "{}");
  const JsonValue& quarantined = workers.find("quarantined")->items.at(0);
  ASSERT_EQ(quarantined.find("suspect_jobs")->items.size(), 1u);
  EXPECT_EQ(quarantined.find("suspect_jobs")->items[0].whole, id);

  const auto other = host.client("submit.token", "bob");
  const JsonValue refused = ask(*other, "retry", "{\"suspect\":\"\"}");
  EXPECT_TRUE(refused.find("ids")->items.empty());
  EXPECT_EQ(refused.find("of_others")->whole, 1u);
  EXPECT_TRUE(ask(*client, "retry", "{\"suspect\":\"another\"}").find("ids")->items.empty());
  EXPECT_EQ(ask(*client, "retry", "{\"suspect\":\"\"}").find("ids")->items.size(), 1u);
  ASSERT_EQ(wait_for_state(*client, id, "done failed"), "done");
  EXPECT_EQ(text_in(ask(*client, "job", job), "taint"), "");
  const auto after = fetched(*client, id, dir.path() / "after");
  ASSERT_TRUE(before.count("irradiance.exr"));
  EXPECT_EQ(after.at("irradiance.exr"), before.at("irradiance.exr"));
}

TEST(ServiceTrust, AQuorumOfMachinesIsNotTakenForOneOfOwners) {
  const TempDir dir;
  write_scene_glb(small_room(), dir.path() / "room.glb");
  const Snapshot snapshot = *take_snapshot(dir.path() / "room.glb", quick_settings());
  for (const bool owners : {false, true}) {
    ServiceHost host(dir.path() / (owners ? "owners" : "shared"), 0);
    if (owners) {
      std::ofstream(host.settings.data / "worker.token", std::ios::app) << "ada the-token-of-adas-machines\n";
      host.restart();
    }
    const auto client = host.client();
    submit(*client, snapshot, "a");
    const std::string note =
        text_in(ask(*client, "submit", submission(snapshot, "b", ",\"quorum\":2")), "note");
    EXPECT_EQ(note.find("machines") != note.npos, !owners) << note;
    EXPECT_EQ(text_in(ask(*client, "submit", submission(snapshot, "c")), "note"), "");
  }
}

}  // namespace
}  // namespace kiln::test

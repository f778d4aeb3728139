// Ended jobs are forgotten by their age, whatever the clock reads at a start.
#include <thread>

#include "common/base/format.h"
#include "coordinator/cli/doctor_steps.h"
#include "coordinator/farm/queue/observed_time.h"
#include "tests/bake/scene_gltf.h"
#include "tests/service/service_host.h"

namespace kiln::test {
namespace {

constexpr int64_t kDay = 86'400'000, kYear = 365 * kDay, kStart = 50 * kYear;

class Retention : public testing::Test {
 protected:
  Retention() : host_(dir_.path() / "data", 0) {
    host_.settings.wall_clock = [this] { return wall_.load(); };
    host_.settings.steady_clock = [this] { return steady_.load(); };
    host_.service.reset();
    std::filesystem::remove_all(dir_.path() / "data");
    host_.restart();
    write_scene_glb(small_room(), dir_.path() / "room.glb");
    snapshot_ = *take_snapshot(dir_.path() / "room.glb", quick_settings());
  }
  uint64_t ended_job() {
    const auto client = host_.client();
    const uint64_t id = submit(*client, snapshot_, text("k{}", ++keys_));
    ask(*client, "cancel", text("{{\"id\":{}}}", id));
    EXPECT_EQ(wait_for_state(*client, id, "cancelled"), "cancelled");
    return id;
  }
  void restart_at(int64_t wall) {
    host_.service.reset();
    wall_ = wall;
    host_.restart();
  }
  std::string doubt() { return ask(*host_.client(), "status", "{}").find("clock_doubt")->text; }

  TempDir dir_;
  std::atomic<int64_t> wall_ = kStart, steady_ = 7;
  ServiceHost host_;
  Snapshot snapshot_;
  int keys_ = 0;
};

TEST_F(Retention, AClockYearsAheadAtAStartForgetsNothing) {
  const uint64_t id = ended_job();
  restart_at(kStart + 2 * kYear);
  EXPECT_TRUE(host_.service->job(id));
  EXPECT_NE(doubt().find("--accept-clock"), std::string::npos) << doubt();
  const DoctorStep step = look_at_kept_clock(host_.settings.data.string(), wall_, false);
  EXPECT_FALSE(step.good);
  EXPECT_NE(step.remedy.find("--accept-clock"), std::string::npos);
  restart_at(kStart + 2 * kYear + kDay / 2);  // it lasts across starts
  EXPECT_TRUE(host_.service->job(id));
  const uint64_t of_the_future = ended_job();
  // The clock is set right: what ended meanwhile ages from now on, instead of in two years.
  restart_at(kStart + kDay);
  EXPECT_EQ(doubt(), "");
  EXPECT_TRUE(host_.service->job(id));
  EXPECT_EQ(host_.service->job(of_the_future)->ended_ms, kStart + kDay);
}

TEST_F(Retention, AClockThatIsBehindMakesNothingOld) {
  restart_at(kStart - 2 * kYear);
  const uint64_t id = ended_job();
  EXPECT_GE(host_.service->job(id)->ended_ms, kStart);
  restart_at(kStart);
  EXPECT_TRUE(host_.service->job(id));
  EXPECT_EQ(doubt(), "");
}

TEST_F(Retention, JobsAreForgottenWhenTheyAreOldAndTheLogSaysHowMany) {
  const uint64_t id = ended_job(), second = ended_job();
  for (int64_t day = 1; day <= 30; ++day) restart_at(kStart + day * kDay);
  EXPECT_TRUE(host_.service->job(id));
  testing::internal::CaptureStderr();
  restart_at(kStart + 31 * kDay);
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_NE(log.find("forgotten, with their results: 2, more than 30 days old"), std::string::npos) << log;
  EXPECT_FALSE(host_.service->job(id));
  EXPECT_FALSE(host_.service->job(second));
}

TEST_F(Retention, ALeapIsBelievedOnceAPersonAcceptsIt) {
  const uint64_t id = ended_job();
  restart_at(kStart + 60 * kDay);
  EXPECT_TRUE(host_.service->job(id));
  host_.service.reset();
  EXPECT_TRUE(look_at_kept_clock(host_.settings.data.string(), wall_, true).good);
  host_.restart();
  EXPECT_EQ(doubt(), "");
  EXPECT_FALSE(host_.service->job(id));
  // An acceptance of another reading is not one of this.
  const uint64_t other = ended_job();
  host_.service.reset();
  ASSERT_TRUE(accept_clock(host_.settings.data, wall_));
  restart_at(wall_ + 60 * kDay);
  EXPECT_TRUE(host_.service->job(other));
  EXPECT_NE(doubt(), "");
}

TEST_F(Retention, AnAnnouncedUploadWithoutBytesIsDropped) {
  const auto idle = host_.client();
  const FileRecord& file = snapshot_.files[0];
  const std::string hex = file.digest.hex();
  const auto part = dir_.path() / "data/blobs" / hex.substr(0, 2) / (hex + ".part");
  ask(*idle, "upload", text("{{\"digest\":\"{}\",\"size\":{}}}", hex, file.size));
  ASSERT_TRUE(std::filesystem::exists(part));
  for (int i = 0; i < 400 && std::filesystem::exists(part); ++i) {
    steady_ += 11 * 60'000;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_FALSE(std::filesystem::exists(part));
  EXPECT_NE(ask_error(*idle, "uploaded", text("{{\"digest\":\"{}\"}}", hex)).find("dropped"),
            std::string::npos);
  // It may be sent again, by anybody.
  const Status sent = host_.client()->upload(snapshot_.sources[0], file.digest, file.size, {});
  EXPECT_TRUE(sent) << sent.error().message;
}

}  // namespace
}  // namespace kiln::test

// The size of a data folder, its growth and what is deleted next.
#include "coordinator/farm/queue/growth.h"

#include "common/base/files.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {

constexpr int64_t kHour = 3'600'000, kDay = 24 * kHour;

FileRecord file(const char* name, uint64_t size) {
  return {name, sha256(bytes_of(std::string_view(name))), size};
}

JobRecord ended(JobId id, int64_t at_ms, std::vector<FileRecord> inputs, std::vector<FileRecord> results) {
  JobRecord job;
  job.id = id;
  job.state = JobState::kDone;
  job.ended_ms = at_ms;
  job.inputs = std::move(inputs);
  job.results = std::move(results);
  return job;
}

TEST(Growth, MeasuresEachKindOnce) {
  const MemoryDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  ASSERT_TRUE(commit_now(*store, job, 1, 1000));
  std::filesystem::create_directories(dir.path() / "blobs/damaged");
  ASSERT_TRUE(write_file_atomic(dir.path() / "blobs/damaged/ab", std::string_view("12345")));
  const std::vector<JobRecord> jobs = {
      ended(1, 0, {file("a", 100), file("b", 20)}, {file("x", 7)}),
      ended(2, 0, {file("a", 100)}, {file("x", 7), file("b", 20), file("y", 3)})};
  const DataSizes sizes = measure_data_folder(dir.path(), jobs);
  EXPECT_EQ(sizes.inputs, 120u);
  EXPECT_EQ(sizes.published, 10u);
  EXPECT_EQ(sizes.spool, 1000 + 88u);
  EXPECT_GT(sizes.database, 4096u);
  EXPECT_EQ(sizes.damaged, 5u);
  EXPECT_EQ(sizes.total(), 120 + 10 + 1088 + sizes.database + 5);
}

TEST(Growth, IsCountedOverAWeekOfObservation) {
  GrowthHistory history;
  EXPECT_FALSE(history.a_day(kDay, {}));
  EXPECT_TRUE(history.add(kDay, {100, 0, 50, 0, 0}));
  EXPECT_FALSE(history.add(kDay + kHour - 1, {999}));
  EXPECT_FALSE(history.a_day(kDay + kHour - 1, {200}));  // too early to say
  const auto half = history.a_day(kDay + kDay / 2, {200, 0, 0, 0, 0});
  ASSERT_TRUE(half);
  EXPECT_DOUBLE_EQ((*half)[0], 200);
  EXPECT_DOUBLE_EQ((*half)[2], -100);
  for (int64_t hour = 1; hour <= 24 * 20; ++hour)
    ASSERT_TRUE(history.add(kDay + hour * kHour, {100 + static_cast<uint64_t>(hour)}));
  EXPECT_EQ(history.samples().size(), 24u * 7 + 1);
  const int64_t now = kDay + 24 * 20 * kHour;
  EXPECT_DOUBLE_EQ((*history.a_day(now, history.samples().back().sizes))[0], 24);
  // A clock that went back says nothing.
  EXPECT_FALSE(history.add(kDay, {1}));
}

TEST(Growth, IsKeptAndADamagedFileIsLeft) {
  const MemoryDir dir;
  EXPECT_TRUE(read_growth(dir.path()).samples().empty());
  GrowthHistory history;
  ASSERT_TRUE(history.add(kDay, {1, 2, 3, 4, 5}));
  ASSERT_TRUE(history.add(kDay + kHour, {6, 7, 8, 9, 10}));
  ASSERT_TRUE(write_growth(dir.path(), history));
  EXPECT_EQ(read_growth(dir.path()).samples(), history.samples());
  for (
      const char* wrong :
      {"", "{}", R"({"samples": 3})", R"({"samples": [{"at_ms": 5}]})",
       R"({"samples": [{"at_ms": -5, "inputs": 1, "published": 1, "spool": 1, "database": 1, "damaged": 1}]})",
       R"({"samples": [{"at_ms": 9, "inputs": 1.5, "published": 1, "spool": 1, "database": 1, "damaged": 1}]})"}) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "growth", std::string_view(wrong)));
    EXPECT_TRUE(read_growth(dir.path()).samples().empty()) << wrong;
  }
  const std::string sizes = R"(, "inputs": 1, "published": 1, "spool": 1, "database": 1, "damaged": 1})";
  const auto expect_left = [&](const std::string& samples, bool left) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "growth", R"({"samples": [)" + samples + "]}"));
    EXPECT_EQ(read_growth(dir.path()).samples().empty(), left) << samples.substr(0, 80);
  };
  expect_left(R"({"at_ms": 9)" + sizes, false);
  expect_left(R"({"at_ms": 1152921504606846976)" + sizes, true);
  expect_left(R"({"at_ms": 9)" + sizes + R"(, {"at_ms": 8)" + sizes, true);
  std::string many = R"({"at_ms": 9)" + sizes;
  for (int i = 0; i < 1024; ++i) many += ",{}";
  expect_left(many, true);
  std::filesystem::remove(dir.path() / "growth");
  std::filesystem::create_directory(dir.path() / "growth");
  EXPECT_TRUE(read_growth(dir.path()).samples().empty()) << "a folder where the file should be";
}

TEST(Growth, AFolderWithoutAnythingHasNoSize) {
  const MemoryDir dir;
  EXPECT_EQ(measure_data_folder(dir.path(), {}).total(), 0u);
}

TEST(Growth, NextDeletionIsWhatRetentionWouldForget) {
  EXPECT_EQ(next_deletion({}, kDay).at_ms, 0);
  std::vector<JobRecord> jobs = {ended(1, 10 * kDay, {file("a", 100), file("b", 20)}, {file("x", 7)}),
                                 ended(2, 10 * kDay + kHour, {file("b", 20)}, {file("y", 5)}),
                                 ended(3, 11 * kDay, {file("a", 100)}, {file("z", 3)}),
                                 ended(4, 9 * kDay, {}, {})};
  JobRecord waiting;  // for job 4, which therefore stays
  waiting.id = 5;
  waiting.state = JobState::kWaiting;
  waiting.after = {4};
  jobs.push_back(waiting);
  const NextDeletion next = next_deletion(jobs, 30 * kDay);
  EXPECT_EQ(next.at_ms, 40 * kDay);
  EXPECT_EQ(next.jobs, (std::vector<JobId>{1, 2}));
  EXPECT_EQ(next.bytes, 20u + 7 + 5);  // "a" is job 3's too
}

TEST(Growth, FullInDays) {
  EXPECT_DOUBLE_EQ(*days_until_full(1000, 50), 20);
  EXPECT_FALSE(days_until_full(1000, 0));
  EXPECT_FALSE(days_until_full(1000, -5));
}

}  // namespace
}  // namespace kiln::test

// Damage to the spool's files, bit by bit and byte by byte.
#include <fcntl.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "coordinator/farm/queue/spool_record.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

struct Spooled {
  MemoryDir dir;
  JobId job = 0;
  fs::path file;
  Spooled(int units) {
    const auto store = open_store(dir.path());
    job = *store->submit(sample_job());
    for (int unit = 0; unit < units; ++unit) EXPECT_TRUE(commit_now(*store, job, unit, 40));
    file = dir.path() / "spool" / std::to_string(job) / "1-1.spool";
  }
};

TEST(Spool, EveryFlippedBitIsFound) {
  const Spooled spooled(3);
  const auto store = open_store(spooled.dir.path());
  const auto rows = *store->commits(spooled.job);
  Bytes bytes = *read_file(spooled.file);
  ASSERT_EQ(bytes.size(), 3 * (kSpoolHead + 40));
  for (size_t bit = (kSpoolHead + 40) * 8; bit < 2 * (kSpoolHead + 40) * 8; ++bit) {
    const std::byte before = bytes[bit / 8];
    bytes[bit / 8] ^= static_cast<std::byte>(1 << bit % 8);
    {
      std::fstream file(spooled.file, std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(bit / 8));
      file.put(static_cast<char>(bytes[bit / 8]));
    }
    const auto damaged = store->read_result(rows[1]);
    ASSERT_FALSE(damaged) << "bit " << bit;
    ASSERT_EQ(damaged.error().kind, ErrorKind::kIo);
    ASSERT_NE(damaged.error().message.find("1-1.spool"), std::string::npos);
    ASSERT_NE(damaged.error().message.find("at 128"), std::string::npos) << damaged.error().message;
    ASSERT_TRUE(store->read_result(rows[0]) && store->read_result(rows[2])) << "bit " << bit;
    bytes[bit / 8] = before;
    std::fstream file(spooled.file, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(bit / 8));
    file.put(static_cast<char>(before));
  }
  EXPECT_TRUE(store->check()->empty());

  // A row that points to another record of the same file.
  CommitRow wrong = rows[1];
  wrong.offset = rows[2].offset;
  EXPECT_EQ(store->read_result(wrong).error().kind, ErrorKind::kIo);
  wrong.offset = ~uint64_t{0} >> 1;
  EXPECT_EQ(store->read_result(wrong).error().kind, ErrorKind::kIo);
  wrong.length = ~uint32_t{0};
  EXPECT_EQ(store->read_result(wrong).error().kind, ErrorKind::kIo);
}

// After a crash between the spool and the database the last record has no row and may have any length.
TEST(Spool, ATornTailIsCutAndNothingElse) {
  const Spooled spooled(2);
  const Bytes whole = *read_file(spooled.file);
  const uint64_t record = kSpoolHead + 40;
  const Bytes payload = sample_payload(77, 40);
  const auto head = write_spool_head(sample_commit(spooled.job, 77, payload), payload);
  Bytes torn = whole;
  torn.insert(torn.end(), head.begin(), head.end());
  torn.insert(torn.end(), payload.begin(), payload.end());
  for (uint64_t length = whole.size(); length <= torn.size(); ++length) {
    ASSERT_TRUE(write_file_atomic(spooled.file, std::span(torn).first(length)));
    const auto store = open_store(spooled.dir.path());
    ASSERT_TRUE(store);
    ASSERT_TRUE(store->compact());
    ASSERT_EQ(fs::file_size(spooled.file), whole.size()) << length;
    ASSERT_EQ(store->commits(spooled.job)->size(), 2u);
    if (length % 16 == 0) ASSERT_TRUE(store->check()->empty());
  }
  // The same with a row, which cannot be as long as the disk keeps what it said: found, and computed again.
  for (uint64_t length = record; length < whole.size(); ++length) {
    ASSERT_TRUE(write_file_atomic(spooled.file, std::span(whole).first(length)));
    const auto store = open_store(spooled.dir.path());
    ASSERT_TRUE(store);
    const auto rows = *store->commits(spooled.job);
    ASSERT_EQ(rows.size(), 2u);
    ASSERT_TRUE(store->read_result(rows[0])) << length;
    ASSERT_EQ(store->read_result(rows[1]).error().kind, ErrorKind::kIo) << length;
  }
  const auto store = open_store(spooled.dir.path());
  EXPECT_EQ(store->check()->size(), 1u);
  ASSERT_TRUE(wait_for([&](auto done) { store->revoke(spooled.job, {1}, done); }));
  ASSERT_TRUE(commit_now(*store, spooled.job, 1, 40));
  EXPECT_EQ(*store->read_result(spooled.job, 1, sha256(sample_payload(1, 40))), sample_payload(1, 40));
  EXPECT_TRUE(store->check()->empty());
}

TEST(Spool, FilesWithoutRowsGoAndStrangersStay) {
  const Spooled spooled(1);
  const fs::path folder = spooled.file.parent_path();
  ASSERT_TRUE(write_file_atomic(folder / "1-2.spool", std::string_view("of a group that was not committed")));
  ASSERT_TRUE(write_file_atomic(folder / "notes.txt", std::string_view("somebody's")));
  fs::create_directories(spooled.dir.path() / "spool" / "9999");
  ASSERT_TRUE(write_file_atomic(spooled.dir.path() / "spool" / "9999" / "1-1.spool", std::string_view("x")));
  const auto store = open_store(spooled.dir.path());
  ASSERT_TRUE(commit_now(*store, spooled.job, 2, 40));  // before the folder is tidied
  ASSERT_TRUE(store->compact());
  EXPECT_FALSE(fs::exists(folder / "1-2.spool"));
  EXPECT_TRUE(fs::exists(folder / "notes.txt"));
  EXPECT_TRUE(fs::exists(spooled.file));
  EXPECT_FALSE(fs::exists(spooled.dir.path() / "spool" / "9999"));
  EXPECT_TRUE(store->read_result(spooled.job, 2, sha256(sample_payload(2, 40))));
}

TEST(Spool, TidiesByItselfOnceNothingIsWritten) {
  const Spooled spooled(1);
  const fs::path stray = spooled.file.parent_path() / "1-2.spool";
  ASSERT_TRUE(write_file_atomic(stray, std::string_view("of a group that was not committed")));
  const auto store = open_store(spooled.dir.path());
  for (int i = 0; i < 600 && fs::exists(stray); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(fs::exists(stray));
}

TEST(Spool, NamesAreReadBackExactly) {
  const SpoolFileId id{12, 3, 4};
  const fs::path path = spool_path("/s", id);
  EXPECT_EQ(spool_id(path), id);
  for (const char* name : {"3-4.spool.x", "3-04.spool", "3.spool", "-3-4.spool", "3-4", "3-4294967296.spool"})
    EXPECT_FALSE(spool_id(fs::path("/s/12") / name)) << name;
  EXPECT_FALSE(spool_id("/s/x/3-4.spool"));
}

}  // namespace
}  // namespace kiln::test

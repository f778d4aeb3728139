// Files, folders and the lock of a data folder, where something else is in their place.
#include "common/base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "coordinator/farm/queue/folder_lock.h"
#include "coordinator/farm/queue/late_checks.h"
#include "coordinator/farm/queue/schema.h"
#include "coordinator/farm/queue/spool.h"
#include "coordinator/farm/queue/spool_record.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST(Files, AnErrorOfTheSystemSaysWhetherSpaceWouldHelp) {
  for (const int code : {ENOSPC, EDQUOT}) {
    errno = code;
    EXPECT_EQ(system_error("write", "x").value().kind, ErrorKind::kNoSpace);
  }
  errno = EACCES;
  EXPECT_EQ(system_error("write", "x").value().kind, ErrorKind::kIo);
  EXPECT_TRUE(says(system_error("write", "x").value().message, "cannot write x: "));
}

TEST(Files, AFileMovesAndClosesWhatItReplaces) {
  const MemoryDir dir;
  OpenFile a(dir.path() / "a", O_RDWR | O_CREAT), b(dir.path() / "b", O_RDWR | O_CREAT);
  const int replaced = a.number();
  a = std::move(b);
  EXPECT_EQ(::fcntl(replaced, F_GETFD), -1);
  EXPECT_EQ(a.path().filename(), "b");
  OpenFile& same = a;
  a = std::move(same);
  EXPECT_TRUE(a.is_open());
  ASSERT_TRUE(a.write_at(real_disk_calls(), bytes_of("words"), 0));
  Bytes more(6);
  const Status status = a.read_at(more, 0);
  ASSERT_FALSE(status);
  EXPECT_TRUE(says(status.error().message, "ends at 5"));
}

TEST(Files, AFolderIsMadeWithThoseAboveItOrAnErrorNamesIt) {
  const MemoryDir dir;
  DiskCalls& disk = real_disk_calls();
  ASSERT_TRUE(make_folder(disk, dir.path() / "a" / "b" / "c"));
  EXPECT_TRUE(fs::is_directory(dir.path() / "a" / "b" / "c"));
  EXPECT_EQ(fs::status(dir.path() / "a" / "b").permissions(), fs::perms::owner_all);
  ASSERT_TRUE(write_file_atomic(dir.path() / "file", std::string_view("x")));
  for (const char* path : {"file", "file/x", "file/x/y"}) {
    const Status status = make_folder(disk, dir.path() / path);
    ASSERT_FALSE(status) << path;
    EXPECT_TRUE(says(status.error().message, "cannot make the folder")) << status.error().message;
  }
  EXPECT_FALSE(sync_folder(disk, dir.path() / "nowhere"));
  EXPECT_TRUE(list_folder(dir.path() / "nowhere").empty());
  const fs::path before = fs::current_path();
  fs::current_path(dir.path());
  EXPECT_TRUE(make_folder(disk, "here"));
  fs::current_path(before);
  EXPECT_TRUE(fs::is_directory(dir.path() / "here"));
}

TEST(FolderLock, NamesItsHolderOnceItHasSigned) {
  const MemoryDir dir;
  {
    auto lock = FolderLock::take(dir.path());
    ASSERT_TRUE(lock);
    EXPECT_TRUE(says(FolderLock::take(dir.path()).error().message, "is in use by another process"));
    ASSERT_TRUE(lock->sign());
    EXPECT_TRUE(says(FolderLock::take(dir.path()).error().message,
                     "is in use by process " + std::to_string(::getpid())));
  }
  EXPECT_EQ(fs::file_size(dir.path() / "lock"), 0u) << "nobody holds it";
  EXPECT_TRUE(FolderLock::take(dir.path()));
  EXPECT_TRUE(fs::exists(dir.path() / "lock")) << "it was there before";
  fs::remove(dir.path() / "lock");
  EXPECT_TRUE(FolderLock::take(dir.path()));
  EXPECT_FALSE(fs::exists(dir.path() / "lock")) << "who did not sign leaves nothing";
  EXPECT_FALSE(FolderLock::take(dir.path() / "nowhere"));
}

TEST(SpoolFiles, ANameThatIsTakenIsAnError) {
  const MemoryDir dir;
  fs::create_directory(dir.path() / "7");
  ASSERT_TRUE(write_file_atomic(dir.path() / "7" / "1-1.spool", std::string_view("somebody's")));
  Spool spool(dir.path(), 1, 1000, real_disk_calls());
  const Bytes payload = sample_payload(1, 10);
  const auto refused = spool.append(sample_commit(7, 1, payload), payload);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(says(refused.error().message, "cannot create"));
  EXPECT_EQ(spool.append(sample_commit(7, 1, payload), payload)->file, 2u) << "the next name is free";
  EXPECT_TRUE(spool.sync().empty());
}

// A hundred jobs in one group: those beyond the bound get a new file each when they go on.
TEST(SpoolFiles, FilesOfIdleJobsAreClosed) {
  const MemoryDir dir;
  Spool spool(dir.path(), 1, 1 << 20, real_disk_calls());
  const Bytes payload = sample_payload(1, 10);
  spool.drop(3);  // nothing of it is here
  for (JobId job = 1; job <= 100; ++job) ASSERT_TRUE(spool.append(sample_commit(job, 1, payload), payload));
  EXPECT_TRUE(spool.sync().empty());
  int more = 0;
  for (JobId job = 1; job <= 100; ++job)
    more += spool.append(sample_commit(job, 2, payload), payload)->file == 2;
  EXPECT_EQ(more, 36);
  EXPECT_TRUE(spool.sync().empty());
  spool.drop(100);
  EXPECT_FALSE(fs::exists(dir.path() / "100"));
  EXPECT_EQ(spool.append(sample_commit(100, 3, payload), payload)->file, 2u) << "a name is not used again";
  EXPECT_TRUE(spool.sync().empty());
  EXPECT_TRUE(spool.sync().empty()) << "there is nothing to sync";
}

TEST(SpoolFiles, ARecordOfAFileThatIsGoneCannotBeOpened) {
  const MemoryDir dir;
  CommitRow row;
  row.job = 1, row.epoch = 1, row.file = 1;
  const auto gone = read_spool_record(dir.path(), row);
  ASSERT_FALSE(gone);
  EXPECT_TRUE(says(gone.error().message, "cannot open"));
}

TEST(SpoolFiles, TidyingNamesWhatItCannotMend) {
  const MemoryDir dir;
  const fs::path own = dir.path() / "7";
  fs::create_directories(own / "1-2.spool" / "x");  // not ours to remove
  fs::create_directory(own / "1-3.spool");          // has no size
  ASSERT_TRUE(write_file_atomic(own / "1-4.spool", Bytes(100)));
  ASSERT_TRUE(write_file_atomic(own / "1-5.spool", Bytes(100)));
  ASSERT_TRUE(write_file_atomic(own / "1-6.spool", Bytes(100)));
  ASSERT_TRUE(write_file_atomic(own / "2-1.spool", std::string_view("of this opening")));
  ASSERT_TRUE(write_file_atomic(own / "2-2.spool", std::string_view("of this opening")));
  const std::map<SpoolFileId, uint64_t> ends = {
      {{7, 1, 1}, 50}, {{7, 1, 3}, 50}, {{7, 1, 4}, 100}, {{7, 1, 5}, 60}, {{7, 1, 6}, 140}};
  const auto faults = tidy_spool(dir.path(), 7, 2, ends);
  const std::string all = ::testing::PrintToString(faults);
  EXPECT_TRUE(says(all, "cannot clean up " + (own / "1-2.spool").string())) << all;
  EXPECT_TRUE(says(all, "cannot clean up " + (own / "1-3.spool").string())) << all;
  EXPECT_TRUE(says(all, (own / "1-1.spool").string() + " has 0 bytes and should have 50")) << all;
  EXPECT_TRUE(says(all, (own / "1-6.spool").string() + " has 100 bytes and should have 140")) << all;
  EXPECT_EQ(fs::file_size(own / "1-4.spool"), 100u);
  EXPECT_EQ(fs::file_size(own / "1-5.spool"), 60u);
  EXPECT_TRUE(fs::exists(own / "2-2.spool"));
}

TEST(SpoolFiles, LateChecksPassOverWhatIsNoJobs) {
  const MemoryDir dir;
  fs::create_directories(dir.path() / "notes");
  fs::create_directories(dir.path() / "9");
  Database database = std::move(*Database::open(dir.path() / "kiln.db"));
  ASSERT_TRUE(migrate(database, store_schema()));
  LateChecks late(dir.path(), 1, {3});
  int steps = 0;
  for (; late.left(); ++steps) ASSERT_TRUE(late.step(database));
  EXPECT_EQ(steps, 4) << "two tables and two jobs";
  EXPECT_TRUE(fs::exists(dir.path() / "notes"));
  EXPECT_FALSE(fs::exists(dir.path() / "9"));
}

}  // namespace
}  // namespace kiln::test

// A disk that is full, fails, or forgets: the reason is told, nothing acknowledged is lost, work goes on
// after.
#include <sys/mount.h>

#include <fstream>
#include <map>

#include "common/base/files.h"
#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

StoreOptions small_options(FaultyDisk& disk) {
  StoreOptions options;
  options.faults = &disk;
  options.spool_file_bytes = 3000;
  options.wal_bytes = 40 << 10;
  return options;
}

// Some of everything; what was acknowledged.
struct Script {
  JobId job = 0;
  std::map<uint64_t, bool> units;  // acknowledged
  uint64_t updated = 0;
  uint64_t failures = 0;

  void run(Store& store) {
    for (uint64_t unit = 0; unit < 12; ++unit) {
      const Bytes payload = sample_payload(unit, 700);
      const Status stored = commit_now(store, sample_commit(job, unit, payload), payload);
      note(stored);
      units[unit] = stored.has_value();
      if (unit % 4 == 3) {
        JobRecord record = *store.job(job);
        record.units_done = unit;
        const Status status = store.update(record);
        note(status);
        if (status) updated = unit;
        note(store.compact());
      }
      // Reading never needs the disk to be well.
      const auto rows = store.commits(job);
      ASSERT_TRUE(rows) << rows.error().message;
      for (const CommitRow& row : *rows) ASSERT_TRUE(store.read_result(row));
    }
  }
  void note(const Status& status) {
    if (status) return;
    ++failures;
    EXPECT_TRUE(status.error().kind == ErrorKind::kIo || status.error().kind == ErrorKind::kNoSpace)
        << status.error().message;
  }
  void expect_in(Store& store) const {
    std::map<uint64_t, CommitRow> rows;
    for (const CommitRow& row : rows_of(store, job)) rows[row.unit] = row;
    for (const auto& [unit, acknowledged] : units) {
      if (!acknowledged) continue;
      ASSERT_TRUE(rows.count(unit)) << unit;
      EXPECT_EQ(*store.read_result(rows[unit]), sample_payload(unit, 700));
    }
    // An update that failed may have reached the disk all the same; one that was acknowledged has.
    EXPECT_GE(store.job(job)->units_done, updated);
  }
};

void strike_everywhere(Fault fault, int64_t times) {
  FaultyDisk disk;
  int64_t changes = 1;
  for (int64_t at = 0; at < changes; ++at) {
    SCOPED_TRACE("operation " + std::to_string(at));
    const MemoryDir dir;
    Script script;
    disk.arm(Fault::kNone, 0, 0);
    {
      const auto store = open_store(dir.path(), small_options(disk));
      ASSERT_TRUE(store);
      JobRecord job = sample_job();
      job.units_done = 0;
      script.job = *store->submit(job);
      disk.arm(fault, at, times);
      script.run(*store);
      if (::testing::Test::HasFailure()) return;
      changes = std::max(changes, disk.count());
      const bool struck = disk.struck() > 0;
      if (times > 1 && struck) EXPECT_FALSE(store->probe());
      disk.arm(Fault::kNone, 0, 0);
      EXPECT_TRUE(store->probe());
      if (struck) EXPECT_GT(script.failures, 0u);
      script.expect_in(*store);
      // What failed may be given again.
      for (auto& [unit, acknowledged] : script.units) {
        if (acknowledged) continue;
        const Status again = commit_now(*store, script.job, unit, 700);
        ASSERT_TRUE(again) << again.error().message;
        acknowledged = true;
      }
      script.expect_in(*store);
      EXPECT_TRUE(store->check()->empty());
    }
    const auto store = open_store(dir.path());
    ASSERT_TRUE(store);
    script.expect_in(*store);
    EXPECT_TRUE(store->check()->empty());
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(changes, 40);
}

TEST(StoreFaults, AWriteThatFailsOnce) {
  strike_everywhere(Fault::kWriteError, 1);
}
TEST(StoreFaults, ASyncThatFailsOnce) {
  strike_everywhere(Fault::kSyncError, 1);
}
TEST(StoreFaults, NoSpaceFromThereOn) {
  strike_everywhere(Fault::kNoSpace, 1000000);
}

// The kernel may drop what it could not write and call it clean: the file is not to be trusted with more.
TEST(StoreFaults, ASpoolFileWhoseSyncFailedIsNeverAppendedTo) {
  const MemoryDir dir;
  FaultyDisk disk;
  StoreOptions options;
  options.faults = &disk;
  const auto store = open_store(dir.path(), options);
  const JobId job = *store->submit(sample_job());
  ASSERT_TRUE(commit_now(*store, job, 1));
  const uint64_t before = (*store->commits(job))[0].file;
  disk.arm(Fault::kSyncError, 0, 1);
  EXPECT_FALSE(commit_now(*store, job, 2));
  ASSERT_EQ(disk.struck(), 1);
  ASSERT_TRUE(commit_now(*store, job, 2));
  ASSERT_TRUE(commit_now(*store, job, 3));
  const auto rows = *store->commits(job);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].file, before);
  EXPECT_NE(rows[1].file, before);
  EXPECT_EQ(rows[2].file, rows[1].file);
  const fs::path first = dir.path() / "spool" / std::to_string(job) / "1-1.spool";
  EXPECT_EQ(fs::file_size(first), 88u + 100u);  // cut to what counts
}

TEST(StoreFaults, AnotherJobIsNotHurt) {
  const MemoryDir dir;
  FaultyDisk disk;
  StoreOptions options;
  options.faults = &disk;
  const auto store = open_store(dir.path(), options);
  const JobId a = *store->submit(sample_job()), b = *store->submit(sample_job());
  ASSERT_TRUE(commit_now(*store, a, 1));
  ASSERT_TRUE(commit_now(*store, b, 1));
  // One group of both: the writer is kept busy until both are queued.
  std::promise<void> busy, go;
  store->put_pass(a, {1, 1}, [&](Status) {
    busy.set_value();
    go.get_future().wait();
  });
  busy.get_future().wait();
  std::promise<Status> of_a, of_b;
  const auto payload = std::make_shared<const Bytes>(sample_payload(2, 50));
  store->commit_result(sample_commit(a, 2, *payload), payload, [&](Status s) { of_a.set_value(s); });
  store->commit_result(sample_commit(b, 2, *payload), payload, [&](Status s) { of_b.set_value(s); });
  disk.arm(Fault::kSyncError, 0, 1);
  go.set_value();
  EXPECT_FALSE(of_a.get_future().get());
  EXPECT_TRUE(of_b.get_future().get());
}

// What is there can be read, nothing is taken, and with space again everything goes on.
TEST(StoreFaults, OpensOnADiskThatIsFull) {
  const MemoryDir dir;
  FaultyDisk disk;
  StoreOptions options;
  options.faults = &disk;
  JobId job = 0;
  uint64_t epoch = 0;
  {
    const auto store = open_store(dir.path(), options);
    job = *store->submit(sample_job());
    ASSERT_TRUE(commit_now(*store, job, 1));
    epoch = store->epoch();
    disk.arm(Fault::kNoSpace, 0, int64_t{1} << 40);  // the log cannot be emptied at the end either
  }
  for (int opening = 0; opening < 2; ++opening) {
    const auto store = open_store(dir.path(), options);
    ASSERT_TRUE(store);
    ASSERT_EQ(store->jobs().size(), 1u);
    const auto rows = rows_of(*store, job);
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(*store->read_result(rows[0]), sample_payload(1, 100));
    EXPECT_EQ(store->submit(sample_job()).error().kind, ErrorKind::kNoSpace);
    EXPECT_EQ(commit_now(*store, job, 2).error().kind, ErrorKind::kNoSpace);
    EXPECT_FALSE(store->probe());
    if (opening == 0) continue;  // it may end like that as well
    disk.arm(Fault::kNone, 0, 0);
    EXPECT_TRUE(store->probe());
    ASSERT_TRUE(commit_now(*store, job, 2));
    EXPECT_EQ(store->epoch(), epoch + 1);
    EXPECT_NE(rows_of(*store, job)[1].epoch, rows[0].epoch);
    EXPECT_TRUE(store->check()->empty());
  }
  EXPECT_EQ(open_store(dir.path())->epoch(), epoch + 2);
}

TEST(StoreFaults, ADiskThatIsReallyFull) {
  const TempDir dir;
  const fs::path disk = dir.path() / "disk";
  fs::create_directories(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=3m") != 0)
    GTEST_SKIP() << "mounting a small file system needs more rights";
  struct Unmount {
    fs::path path;
    ~Unmount() { ::umount2(path.c_str(), MNT_DETACH); }
  } unmount{disk};
  const fs::path filler = disk / "filler";
  std::ofstream(filler) << std::string(1 << 20, 'x');
  {
    const auto store = open_store(disk / "store");
    ASSERT_TRUE(store);
    const JobId job = *store->submit(sample_job());
    uint64_t good = 0;
    Status status;
    while (status && good < 1000) {
      status = commit_now(*store, job, good, 20000);
      good += status ? 1 : 0;
    }
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::kNoSpace) << status.error().message;
    EXPECT_GT(good, 20u);
    const Status probe = store->probe();
    ASSERT_FALSE(probe);
    EXPECT_EQ(probe.error().kind, ErrorKind::kNoSpace);
    EXPECT_EQ(store->commits(job)->size(), good);
    fs::remove(filler);
    EXPECT_TRUE(store->probe());
    ASSERT_TRUE(commit_now(*store, job, good, 20000));
    EXPECT_EQ(store->commits(job)->size(), good + 1);
    EXPECT_TRUE(store->check()->empty());
  }
  ASSERT_EQ(::mount("", disk.c_str(), "", MS_REMOUNT | MS_RDONLY, ""), 0);
  const auto refused = Store::open(disk / "store", {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("Read-only"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace kiln::test

// Backups: what is in them, what stops them, and the notes by which another program asks for one.
#include "coordinator/farm/queue/backup.h"

#include <sys/stat.h>

#include "common/base/files.h"
#include "coordinator/farm/queue/observed_time.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

// A data folder with two jobs, three results and the blobs that the jobs name.
struct DataFolder {
  MemoryDir dir;
  std::unique_ptr<Store> store = open_store(dir.path());
  std::unique_ptr<BlobStore> blobs;
  std::vector<Digest> digests;
  JobId job = 0;

  DataFolder() {
    BlobOptions options;
    options.keep_free = options.keep_free_publishing = 0;
    blobs = std::move(*BlobStore::open(dir.path() / "blobs", options));
    JobRecord record = sample_job();
    record.inputs.clear();
    record.results.clear();
    for (uint64_t i = 0; i < 3; ++i) {
      const Bytes bytes = sample_payload(i, 1000);
      digests.push_back(sha256(bytes));
      EXPECT_TRUE(write_file_atomic(dir.path() / "source", bytes));
      EXPECT_TRUE(blobs->put_file(dir.path() / "source", 9));
      record.inputs.push_back({i ? std::to_string(i) : "room.gltf", digests.back(), bytes.size()});
    }
    job = *store->submit(record);
    record.submission += "b";
    EXPECT_TRUE(store->submit(record));
    for (uint64_t unit = 0; unit < 3; ++unit) EXPECT_TRUE(commit_now(*store, job, unit, 500));
    EXPECT_TRUE(write_clock(dir.path(), {77, 0, 0}));
  }
  Expected<BackedUp> back_up_to(const fs::path& folder, const GoesOn& goes_on = {}) {
    return back_up(*store, *blobs, folder, goes_on);
  }
  // What a backup writes beside its target is gone when it ends.
  void expect_tidy() const { EXPECT_FALSE(fs::exists(dir.path() / "work/backup")); }
};

// Opens a backup as a data folder.
void expect_whole(const fs::path& folder, const DataFolder& data) {
  ASSERT_TRUE(is_whole_backup(folder));
  const auto store = open_store(folder);
  ASSERT_TRUE(store);
  EXPECT_EQ(store->jobs(), data.store->jobs());
  const auto rows = rows_of(*store, data.job);
  ASSERT_EQ(rows.size(), 3u);
  for (const CommitRow& row : rows) EXPECT_EQ(*store->read_result(row), sample_payload(row.unit, 500));
  EXPECT_TRUE(store->check()->empty());
  EXPECT_EQ(read_clock(folder), (ClockRecord{77, 0, 0}));
}

TEST(Backup, HasAllOfADataFolderAndIsItsOwners) {
  DataFolder data;
  const fs::path folder = data.dir.path() / "copy";
  const auto made = data.back_up_to(folder);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->jobs, 2u);
  EXPECT_EQ(made->files, 4u);  // a spool file and three blobs
  EXPECT_EQ(made->linked, 3u);
  EXPECT_EQ(made->bytes, 3 * (88 + 500u));
  EXPECT_EQ(made->damaged, 0u);
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::hard_link_count(data.blobs->path(data.digests[0])), 2u);
  data.expect_tidy();
  expect_whole(folder, data);
}

TEST(Backup, IsCopiedAndVerifiedWhereLinksAreImpossible) {
  DataFolder data;
  const TempDir elsewhere;
  struct stat here, there;
  ASSERT_EQ(::stat(data.dir.path().c_str(), &here), 0);
  ASSERT_EQ(::stat(elsewhere.path().c_str(), &there), 0);
  if (here.st_dev == there.st_dev) GTEST_SKIP() << "one file system";
  flip_bit(data.blobs->path(data.digests[1]));
  const fs::path folder = elsewhere.path() / "copy";
  const auto made = data.back_up_to(folder);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->linked, 0u);
  EXPECT_EQ(made->files, 3u);
  EXPECT_EQ(made->bytes, 3 * (88 + 500u) + 2000);
  EXPECT_EQ(made->damaged, 1u);
  const std::string hex = data.digests[1].hex();
  EXPECT_FALSE(fs::exists(folder / "blobs" / hex.substr(0, 2) / hex));
  expect_whole(folder, data);
}

TEST(Backup, CountsBlobsThatAreGoneAndGoesOn) {
  DataFolder data;
  fs::remove(data.blobs->path(data.digests[2]));
  fs::remove(data.dir.path() / "clock");
  const auto made = data.back_up_to(data.dir.path() / "copy");
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->damaged, 1u);
  EXPECT_EQ(made->linked, 2u);
  EXPECT_FALSE(fs::exists(data.dir.path() / "copy/clock"));
}

TEST(Backup, LeavesNothingBehindWhereverItIsStopped) {
  DataFolder data;
  const fs::path folder = data.dir.path() / "copy";
  int questions = 0;
  ASSERT_TRUE(data.back_up_to(folder, [&] { return ++questions > 0; }));
  EXPECT_EQ(questions, 4);
  for (int most = 0; most < questions; ++most) {
    fs::remove_all(folder);
    int asked = 0;
    const auto stopped = data.back_up_to(folder, [&] { return asked++ < most; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().kind, ErrorKind::kUnavailable);
    EXPECT_FALSE(fs::exists(folder));
    data.expect_tidy();
  }
}

TEST(Backup, IsMadeInAFolderOfItsOwn) {
  DataFolder data;
  const fs::path folder = data.dir.path() / "copy";
  fs::create_directories(folder);
  ASSERT_TRUE(write_file_atomic(folder / "mine", std::string_view("x")));
  const auto refused = data.back_up_to(folder);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kUsage);
  EXPECT_TRUE(fs::exists(folder / "mine"));
  fs::remove(folder / "mine");
  EXPECT_TRUE(data.back_up_to(folder)) << "an empty one may be there";
  EXPECT_FALSE(data.back_up_to(data.dir.path() / "source/copy")) << "below a file";
}

TEST(Backup, FailsOnWhatCannotBeReadOrLinkedAndSaysWhat) {
  DataFolder data;
  const fs::path folder = data.dir.path() / "copy", spool = data.dir.path() / "spool/1";
  fs::create_directory_symlink("nowhere", spool / "9-9.spool");
  auto failed = data.back_up_to(folder);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("cannot open"), std::string::npos) << failed.error().message;
  EXPECT_NE(failed.error().message.find("9-9.spool"), std::string::npos) << failed.error().message;
  EXPECT_FALSE(fs::exists(folder));
  fs::remove(spool / "9-9.spool");
  fs::create_directory(spool / "a folder");
  failed = data.back_up_to(folder);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("cannot link"), std::string::npos) << failed.error().message;
  fs::remove(spool / "a folder");
  fs::remove(data.dir.path() / "clock");
  fs::create_directory(data.dir.path() / "clock");
  failed = data.back_up_to(folder);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("clock"), std::string::npos) << failed.error().message;
  EXPECT_FALSE(fs::exists(folder));
  data.expect_tidy();
}

TEST(Backup, ItsNoteComesBackAndADamagedOneIsNone) {
  const MemoryDir dir;
  EXPECT_EQ(read_backup_note(dir.path()).at_ms, 0);
  ASSERT_TRUE(note_backup(dir.path(), 5000, {1, 2, 3, 4, 5}));
  const BackupNote note = read_backup_note(dir.path());
  EXPECT_EQ(note.at_ms, 5000);
  EXPECT_EQ(note.made.jobs, 1u);
  EXPECT_EQ(note.made.files, 2u);
  EXPECT_EQ(note.made.linked, 3u);
  EXPECT_EQ(note.made.bytes, 4u);
  EXPECT_EQ(note.made.damaged, 5u);
  for (const char* wrong : {"", "{}", R"({"at_ms": -5})", R"({"at_ms": 1.5})", R"({"at_ms": "x"})",
                            R"({"at_ms": 1152921504606846976})"}) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "last-backup.json", std::string_view(wrong)));
    EXPECT_EQ(read_backup_note(dir.path()).at_ms, 0) << wrong;
  }
  ASSERT_TRUE(write_file_atomic(dir.path() / "last-backup.json", std::string_view(R"({"at_ms": 7})")));
  EXPECT_EQ(read_backup_note(dir.path()).at_ms, 7);
  EXPECT_EQ(read_backup_note(dir.path()).made.jobs, 0u);
}

TEST(Backup, ARequestIsTakenOnceOrWithdrawn) {
  const MemoryDir dir;
  const fs::path request = dir.path() / "backup-request";
  EXPECT_FALSE(take_backup_request(dir.path()));
  EXPECT_FALSE(withdraw_backup_request(dir.path()));
  ASSERT_TRUE(request_backup(dir.path(), "/backups/monday"));
  EXPECT_EQ(take_backup_request(dir.path()), fs::path("/backups/monday"));
  EXPECT_FALSE(take_backup_request(dir.path()));
  ASSERT_TRUE(request_backup(dir.path(), "/backups/tuesday"));
  EXPECT_TRUE(withdraw_backup_request(dir.path()));
  EXPECT_FALSE(take_backup_request(dir.path()));
  ASSERT_TRUE(request_backup(dir.path(), "relative"));
  EXPECT_FALSE(take_backup_request(dir.path())) << "relative to which program's folder?";
  ASSERT_TRUE(write_file_atomic(request, std::string(20000, '/')));
  EXPECT_FALSE(take_backup_request(dir.path())) << "too long";
  EXPECT_FALSE(fs::exists(request));
  fs::create_directories(request / "x");
  EXPECT_FALSE(take_backup_request(dir.path())) << "cannot be removed, so it would be taken for ever";
}

TEST(Backup, AnAnswerComesBackAndADamagedOneIsAnError) {
  const MemoryDir dir;
  EXPECT_FALSE(take_backup_answer(dir.path()));
  ASSERT_TRUE(answer_backup(dir.path(), BackedUp{1, 2, 3, 4, 5}));
  const auto good = take_backup_answer(dir.path());
  ASSERT_TRUE(good && *good);
  EXPECT_EQ((*good)->bytes, 4u);
  EXPECT_FALSE(take_backup_answer(dir.path()));
  ASSERT_TRUE(answer_backup(dir.path(), fail(ErrorKind::kNoSpace, "no space")));
  const auto bad = take_backup_answer(dir.path());
  ASSERT_TRUE(bad && !*bad);
  EXPECT_EQ(bad->error().message, "no space");
  for (const char* wrong : {"", "{}", "[]"}) {
    ASSERT_TRUE(write_file_atomic(dir.path() / "backup-answer", std::string_view(wrong)));
    const auto answer = take_backup_answer(dir.path());
    ASSERT_TRUE(answer && !*answer) << wrong;
    EXPECT_NE(answer->error().message.find("cannot be read"), std::string::npos);
  }
  // One of an earlier request is not that of the next.
  ASSERT_TRUE(answer_backup(dir.path(), BackedUp{}));
  ASSERT_TRUE(request_backup(dir.path(), "/backups"));
  EXPECT_FALSE(take_backup_answer(dir.path()));
}

}  // namespace
}  // namespace kiln::test

// Rows of the database that no store has written: an opening, a check or a change says what is wrong with
// them.
#include "common/base/files.h"
#include "coordinator/farm/queue/sqlite.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

struct Folder {
  MemoryDir dir;
  JobId job = 0;

  Folder() {
    const auto store = open_store(dir.path());
    job = *store->submit(sample_job());
    EXPECT_TRUE(commit_now(*store, job, 1));
    EXPECT_TRUE(wait_for([&](auto done) { store->note_trust("render7", 3, 5, done); }));
  }
  // Of a closed store.
  void edit(const std::string& sql) {
    Database database = std::move(*Database::open(dir.path() / "kiln.db"));
    const Status status = database.script(sql);
    ASSERT_TRUE(status) << status.error().message;
    ASSERT_TRUE(database.checkpoint());
  }
  void expect_refused(const std::string& words) {
    const auto store = Store::open(dir.path(), {});
    ASSERT_FALSE(store) << words;
    EXPECT_EQ(store.error().kind, ErrorKind::kIo);
    EXPECT_NE(store.error().message.find(words), std::string::npos) << store.error().message;
  }
};

TEST(Damage, ARecordOfAJobThatCannotBeReadIsNamed) {
  for (const char* sql : {"UPDATE jobs SET after=x'01'", "UPDATE jobs SET inputs=x'01'",
                          "UPDATE jobs SET results=x'01'", "UPDATE jobs SET priority=1000"}) {
    SCOPED_TRACE(sql);
    Folder f;
    f.edit(sql);
    f.expect_refused("the record of job " + std::to_string(f.job) + " is damaged");
  }
}

TEST(Damage, ARecordOfAWorkerThatCannotBeReadIsNamed) {
  Folder f;
  f.edit("UPDATE workers SET numeric_classes=x'01'");
  f.expect_refused("the record of worker render7 is damaged");
}

TEST(Damage, ADatabaseWithoutAnEpochIsDamaged) {
  Folder f;
  f.edit("DELETE FROM about WHERE key='epoch'");
  f.expect_refused("has no epoch");
}

// A trigger stands for whatever SQLite may reject.
TEST(Damage, AStoreWhoseFirstWriteIsRejectedIsNotOpened) {
  Folder f;
  f.edit("CREATE TRIGGER no BEFORE UPDATE ON about BEGIN SELECT RAISE(ABORT,'no new life'); END");
  const auto store = Store::open(f.dir.path(), {});
  ASSERT_FALSE(store);
  EXPECT_NE(store.error().message.find("no new life"), std::string::npos) << store.error().message;
  f.edit("DROP TRIGGER no");
  EXPECT_EQ(open_store(f.dir.path())->jobs().size(), 1u);
}

TEST(Damage, AChangeThatIsRejectedHalfwayChangesNothing) {
  Folder f;
  f.edit(
      "CREATE TRIGGER keep BEFORE DELETE ON unit_results BEGIN SELECT RAISE(ABORT,'results stay'); END;"
      "INSERT INTO unproven VALUES(" +
      std::to_string(f.job) +
      ",'liar',2);"
      "CREATE TRIGGER as_it_is BEFORE UPDATE OF tainted ON jobs BEGIN SELECT RAISE(ABORT,'jobs stay'); END");
  const auto store = open_store(f.dir.path());
  const Status revoked = wait_for([&](auto done) { store->revoke(f.job, {1}, done); });
  ASSERT_FALSE(revoked);
  EXPECT_NE(revoked.error().message.find("results stay"), std::string::npos);
  EXPECT_EQ(rows_of(*store, f.job).size(), 1u);
  const Status quarantined = wait_for([&](auto done) { store->quarantine("liar", "it lied", 5, done); });
  ASSERT_FALSE(quarantined);
  EXPECT_NE(quarantined.error().message.find("jobs stay"), std::string::npos);
  EXPECT_FALSE(store->worker("liar")) << "half a quarantine";
}

TEST(Damage, ACheckNamesRowsAndFilesThatBelongToNoJob) {
  Folder f;
  f.edit(
      "INSERT INTO unit_results SELECT 77,unit,digest,shape,worker,verified,settled,epoch,file,offset,length "
      "FROM unit_results;"
      "INSERT INTO passes VALUES(77,1,1),(78,1,1); INSERT INTO events(job,at_ms,text) VALUES(79,1,'x')");
  const auto store = open_store(f.dir.path());
  ASSERT_TRUE(store->compact());  // tidies the spool
  const fs::path own = f.dir.path() / "spool" / std::to_string(f.job);
  ASSERT_TRUE(write_file_atomic(own / "notes", std::string_view("somebody's")));
  fs::create_directories(f.dir.path() / "spool" / "88");
  ASSERT_TRUE(write_file_atomic(f.dir.path() / "spool" / "88" / "1-1.spool", std::string_view("x")));
  const auto faults = store->check();
  ASSERT_TRUE(faults);
  const std::string all = ::testing::PrintToString(*faults);
  for (const char* words :
       {"1 results belong to no job", "2 passes belong to no job", "1 events belong to no job",
        "notes belongs to no job", "88/1-1.spool belongs to no"})
    EXPECT_NE(all.find(words), std::string::npos) << words << " in " << all;
  EXPECT_EQ(faults->size(), 5u) << all;
}

TEST(Damage, AnIndexThatDiffersFromItsTableIsFound) {
  Folder f;
  f.edit(
      "PRAGMA writable_schema=ON;"
      "UPDATE sqlite_schema SET sql='CREATE INDEX jobs_of_submission ON jobs(user)' "
      "WHERE name='jobs_of_submission'; PRAGMA writable_schema=OFF");
  Folder other;
  const auto store = Store::open(f.dir.path(), {});
  if (!store) return;  // found at once
  const auto faults = (*store)->check();
  ASSERT_TRUE(faults);
  EXPECT_FALSE(faults->empty());
}

TEST(Damage, AQuarantineLooksPastResultsOfJobsThatAreGone) {
  Folder f;
  f.edit("INSERT INTO unproven VALUES(99,'liar',3),(" + std::to_string(f.job) + ",'liar',2)");
  const auto store = open_store(f.dir.path());
  ASSERT_TRUE(wait_for([&](auto done) { store->quarantine("liar", "it lied", 5, done); }));
  EXPECT_TRUE(store->worker("liar")->quarantined);
  EXPECT_EQ(store->job(f.job)->taint.rfind("unit 5 was skipped; 2 ", 0), 0u) << store->job(f.job)->taint;
}

}  // namespace
}  // namespace kiln::test

// The wrapper of SQLite: kinds of errors, values that are not there, and copies on a disk that fails.
#include "coordinator/farm/queue/sqlite.h"

#include <sqlite3.h>

#include "common/base/files.h"
#include "coordinator/farm/queue/schema.h"
#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

struct Opened {
  MemoryDir dir;
  Database database = std::move(*Database::open(dir.path() / "x.db"));
};

TEST(Sqlite, AnErrorsKindSaysWhoCanHelp) {
  const Opened o;
  const auto kind = [&](int code) { return o.database.error(code).value().kind; };
  EXPECT_EQ(kind(SQLITE_FULL), ErrorKind::kNoSpace);
  EXPECT_EQ(kind(SQLITE_NOMEM), ErrorKind::kNoSpace);
  EXPECT_EQ(kind(SQLITE_BUSY), ErrorKind::kUnavailable);
  EXPECT_EQ(kind(SQLITE_LOCKED), ErrorKind::kUnavailable);
  for (const int code : {SQLITE_IOERR, SQLITE_IOERR_FSYNC, SQLITE_READONLY, SQLITE_CANTOPEN, SQLITE_CORRUPT,
                         SQLITE_NOTADB, SQLITE_PERM, SQLITE_PROTOCOL})
    EXPECT_EQ(kind(code), ErrorKind::kIo) << code;
  EXPECT_EQ(kind(SQLITE_ERROR), ErrorKind::kInternal);
  EXPECT_EQ(kind(SQLITE_CONSTRAINT), ErrorKind::kInternal);
}

TEST(Sqlite, AnErrorNamesTheFileBeforeAndAfterItIsClosed) {
  Opened o;
  EXPECT_NE(o.database.error(SQLITE_CORRUPT).value().message.find("x.db"), std::string::npos);
  o.database.close();
  const std::string closed = o.database.error(SQLITE_CORRUPT).value().message;
  EXPECT_NE(closed.find("malformed"), std::string::npos) << closed;
  const auto folder = Database::open(o.dir.path());
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().kind, ErrorKind::kIo);
}

TEST(Sqlite, AStatementThatIsRejectedFailsWhateverIsBound) {
  Opened o;
  const Bytes bytes = sample_payload(1, 3);
  const Status failed = o.database.run("SELECT ?1,?2,?3,?4 FROM nowhere", int64_t{1}, 2.5,
                                       std::string_view("text"), std::span<const std::byte>(bytes));
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::kInternal);
  EXPECT_NE(failed.error().message.find("no such table: nowhere"), std::string::npos);
  EXPECT_FALSE(o.database.script("no statement"));
}

TEST(Sqlite, WhatIsMissingIsEmpty) {
  Opened o;
  Query query = o.database.ask("SELECT NULL,NULL,NULL,x'0102',?1,?2,?3", std::string_view(),
                               std::span<const std::byte>(), sha256({}));
  ASSERT_TRUE(*query.next());
  EXPECT_EQ(query.string(), "");
  EXPECT_TRUE(query.blob().empty());
  EXPECT_EQ(query.digest(), Digest{});
  EXPECT_EQ(query.digest(), Digest{}) << "two bytes are no digest";
  EXPECT_EQ(query.string(), "");
  EXPECT_TRUE(query.blob().empty());
  EXPECT_EQ(query.digest(), sha256({}));
  EXPECT_FALSE(*query.next());
}

TEST(Sqlite, ALogThatIsNotThereHasNoSize) {
  Opened o;
  ASSERT_TRUE(o.database.script("CREATE TABLE a(x)"));
  EXPECT_GT(o.database.wal_size(), 0u);
  ASSERT_TRUE(o.database.checkpoint());
  o.database.close();
  EXPECT_EQ(o.database.wal_size(), 0u);
}

TEST(Sqlite, ACopyIsWholeOrAnErrorWhereverTheDiskFails) {
  for (const Fault fault : {Fault::kWriteError, Fault::kNoSpace, Fault::kSyncError}) {
    const MemoryDir dir;
    FaultyDisk disk;
    Database database = std::move(*Database::open(dir.path() / "x.db"));
    ASSERT_TRUE(database.script("CREATE TABLE a(x); INSERT INTO a VALUES(zeroblob(50000)),(7)"));
    bool whole = false;
    int64_t failures = 0;
    for (int64_t at = 0; !whole && at < 200; ++at) {
      const fs::path copy = dir.path() / (std::to_string(at) + ".db");
      disk.arm(fault, at, 1 << 20);
      const Status status = database.copy_to(copy);
      disk.arm(Fault::kNone, 0, 0);
      whole = status.has_value();
      if (!whole) {
        ++failures;
        // A full disk has no word for a truncation that fails.
        const bool full =
            fault == Fault::kNoSpace &&
            status.error().message.find(std::to_string(SQLITE_IOERR_TRUNCATE)) == std::string::npos;
        EXPECT_EQ(status.error().kind, full ? ErrorKind::kNoSpace : ErrorKind::kIo)
            << at << status.error().message;
        continue;
      }
      Database read = std::move(*Database::open(copy));
      Query query = read.ask("SELECT count(*),sum(length(x)) FROM a");
      ASSERT_TRUE(*query.next());
      EXPECT_EQ(query.integer(), 2);
      EXPECT_EQ(query.integer(), 50001);
    }
    EXPECT_TRUE(whole);
    EXPECT_GT(failures, 2);
  }
}

TEST(Sqlite, AHeaderThatIsNotThereIsAnError) {
  const MemoryDir dir;
  EXPECT_FALSE(read_database_header(dir.path() / "gone"));
  EXPECT_TRUE(check_schema(dir.path() / "gone", 3));
  ASSERT_TRUE(write_file_atomic(dir.path() / "empty", std::string_view()));
  EXPECT_TRUE(check_schema(dir.path() / "empty", 3));
  ASSERT_TRUE(write_file_atomic(dir.path() / "short", std::string_view("SQLite format 3")));
  EXPECT_FALSE(check_schema(dir.path() / "short", 3));
}

TEST(Sqlite, ADatabaseOfAnotherProgramIsKnownByItsNumbers) {
  struct Case {
    uint32_t application, version;
    bool ours;
  };
  for (const auto& [application, version, ours] :
       {Case{0, 0, true}, {kStoreApplication, 3, true}, {0, 2, false}, {5, 0, false}, {5, 2, false}}) {
    const MemoryDir dir;
    {
      Database database = std::move(*Database::open(dir.path() / "x.db"));
      ASSERT_TRUE(database.script("CREATE TABLE a(x); PRAGMA application_id=" + std::to_string(application) +
                                  "; PRAGMA user_version=" + std::to_string(version)));
      ASSERT_TRUE(database.checkpoint());
    }
    EXPECT_EQ(check_schema(dir.path() / "x.db", 3).has_value(), ours) << application << " " << version;
  }
}

}  // namespace
}  // namespace kiln::test

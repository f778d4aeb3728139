// The writer by itself: groups of operations of which some fail, alone or with their group.
#include <fstream>

#include "common/base/files.h"
#include "coordinator/farm/queue/group_writer.h"
#include "coordinator/farm/queue/schema.h"
#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

Status refused() {
  return fail(ErrorKind::kUnavailable, "not yet");
}

// Operations that are given while it is held up are one group.
class Writer {
 public:
  explicit Writer(StoreOptions options = {}, GroupWriter::FirstWrite first = {},
                  uint64_t file_bytes = 1 << 20) {
    JobRecord job = sample_job();
    job.id = 1;
    cache_ = std::make_unique<RecordCache>(std::map<JobId, JobRecord>{{1, job}},
                                           std::map<std::string, WorkerRecord>{});
    Database database = std::move(*Database::open(dir_.path() / "kiln.db"));
    EXPECT_TRUE(migrate(database, store_schema()));
    writer_ = std::make_unique<GroupWriter>(std::move(database), Spool(spool(), 1, file_bytes, disk_),
                                            *cache_, options, std::move(first), LateChecks(spool(), 1, {}));
  }
  ~Writer() { disk_.arm(Fault::kNone, 0, 0); }

  // The outcomes of these operations, in their order.
  std::vector<Status> group(std::vector<Operation> operations) {
    std::promise<void> begun, go;
    Operation hold;
    hold.reads = true;
    hold.done = [&](Status) {
      begun.set_value();
      go.get_future().wait();
    };
    writer_->give(std::move(hold));
    begun.get_future().wait();
    std::vector<std::promise<Status>> promises(operations.size());
    for (size_t i = 0; i < operations.size(); ++i) {
      operations[i].done = [&promises, i](Status status) { promises[i].set_value(std::move(status)); };
      writer_->give(std::move(operations[i]));
    }
    go.set_value();
    std::vector<Status> outcomes;
    for (auto& promise : promises) outcomes.push_back(promise.get_future().get());
    return outcomes;
  }
  Status alone(Operation operation) { return writer_->give_and_wait(std::move(operation)); }

  int64_t count(const char* sql) {
    int64_t found = -1;
    Operation operation;
    operation.reads = true;
    operation.apply = [&](GroupTransaction& t) -> Status {
      Query query = t.database().ask(sql);
      KILN_TRY_STATUS(query.next());
      found = query.integer();
      return {};
    };
    EXPECT_TRUE(alone(std::move(operation)));
    return found;
  }
  int64_t passes() { return count("SELECT count(*) FROM passes"); }
  int64_t results() { return count("SELECT count(*) FROM unit_results"); }

  fs::path spool() const { return dir_.path() / "spool"; }
  FaultyDisk& disk() { return disk_; }
  GroupWriter& writer() { return *writer_; }

 private:
  MemoryDir dir_;
  FaultyDisk disk_;
  std::unique_ptr<RecordCache> cache_;
  std::unique_ptr<GroupWriter> writer_;
};

Operation pass(uint32_t number) {
  Operation operation;
  operation.apply = [number](GroupTransaction& t) { return t.tables().put_pass(1, {number, 1}); };
  return operation;
}

Operation statement(const char* sql, bool reads = false) {
  Operation operation;
  operation.reads = reads;
  operation.apply = [sql](GroupTransaction& t) { return t.database().script(sql); };
  return operation;
}

Operation result(JobId job, uint64_t unit, size_t size) {
  Operation operation;
  operation.payload = std::make_shared<Operation::Payload>();
  operation.payload->bytes = std::make_shared<const Bytes>(sample_payload(unit, size));
  operation.payload->commit = sample_commit(job, unit, *operation.payload->bytes);
  operation.apply = [payload = operation.payload.get()](GroupTransaction& t) -> Status {
    if (!payload->place) return fail(ErrorKind::kInvalidInput, "it has no place");
    const UnitCommit& c = payload->commit;
    return t.tables().add_result({c.job, c.unit, c.shape, c.digest, c.worker, false, false,
                                  payload->place->epoch, payload->place->file, payload->place->offset,
                                  static_cast<uint32_t>(payload->bytes->size())});
  };
  return operation;
}

TEST(Writer, AStatementThatIsRejectedFailsItsOperationAlone) {
  Writer w;
  std::vector<Operation> operations;
  operations.push_back(pass(1));
  operations.push_back(statement("INSERT INTO nowhere VALUES(1)"));
  operations.push_back(statement("SELECT nothing", true));
  operations.push_back(pass(2));
  const std::vector<Status> outcomes = w.group(std::move(operations));
  EXPECT_TRUE(outcomes[0]);
  EXPECT_EQ(outcomes[1].error().kind, ErrorKind::kInternal);
  EXPECT_EQ(outcomes[2].error().kind, ErrorKind::kInternal) << "a question changes nothing for the others";
  EXPECT_TRUE(outcomes[3]);
  EXPECT_EQ(w.passes(), 2);
}

TEST(Writer, ARejectedStatementAloneIsItsOwnFault) {
  Writer w;
  EXPECT_EQ(w.alone(statement("INSERT INTO nowhere VALUES(1)")).error().kind, ErrorKind::kInternal);
  EXPECT_TRUE(w.alone(pass(1)));
  EXPECT_EQ(w.passes(), 1);
}

TEST(Writer, OnADiskThatFailsQuestionsAreAnsweredAllTheSame) {
  Writer w;
  ASSERT_TRUE(w.alone(pass(1)));
  std::vector<Operation> operations;
  operations.push_back(pass(2));
  operations.push_back(statement("SELECT 1", true));
  operations.push_back(pass(3));
  w.disk().arm(Fault::kWriteError, 0, 1 << 20);
  const std::vector<Status> outcomes = w.group(std::move(operations));
  w.disk().arm(Fault::kNone, 0, 0);
  EXPECT_EQ(outcomes[0].error().kind, ErrorKind::kIo);
  EXPECT_TRUE(outcomes[1]);
  EXPECT_EQ(outcomes[2].error().kind, ErrorKind::kIo);
  EXPECT_EQ(w.passes(), 1);
}

TEST(Writer, AQuestionThatEndsTheTransactionIsAnError) {
  Writer w;
  std::vector<Operation> operations;
  operations.push_back(statement("COMMIT", true));
  EXPECT_FALSE(w.group(std::move(operations))[0]);
  EXPECT_TRUE(w.alone(pass(1)));
  EXPECT_EQ(w.passes(), 1);
}

TEST(Writer, AnOperationAfterTheEndFailsWhetherAnybodyWaitsOrNot) {
  Writer w;
  w.writer().stop();
  EXPECT_EQ(w.alone(pass(1)).error().kind, ErrorKind::kUnavailable);
  w.writer().give(pass(2));
  w.writer().stop();
}

TEST(Writer, WhatMustBeWrittenFirstIsTriedBeforeEachGroupThatWrites) {
  int tries = 0;
  bool good = false;
  Writer w({}, [&](Database&) -> Status {
    ++tries;
    return good ? Status() : refused();
  });
  EXPECT_TRUE(w.alone(statement("SELECT 1", true)));
  EXPECT_EQ(tries, 0) << "a question needs nothing to be written";
  std::vector<Operation> operations;
  operations.push_back(statement("SELECT 1", true));
  operations.push_back(pass(1));
  operations.push_back(result(1, 1, 10));
  std::vector<Status> outcomes = w.group(std::move(operations));
  EXPECT_TRUE(outcomes[0]);
  EXPECT_EQ(outcomes[1].error().kind, ErrorKind::kUnavailable);
  EXPECT_EQ(outcomes[2].error().kind, ErrorKind::kUnavailable);
  EXPECT_FALSE(fs::exists(w.spool())) << "nothing is written before it";
  good = true;
  EXPECT_TRUE(w.alone(pass(1)));
  EXPECT_TRUE(w.alone(pass(2)));
  EXPECT_EQ(tries, 2);
  EXPECT_EQ(w.passes(), 2);
}

TEST(Writer, AGroupHasItsBoundsInOperationsAndInBytes) {
  for (const auto& [operations, bytes] : {std::pair<size_t, uint64_t>{2, 1 << 20}, {100, 150}}) {
    StoreOptions options;
    options.group_operations = operations;
    options.group_bytes = bytes;
    Writer w(options);
    std::vector<Operation> all;
    for (uint64_t unit = 1; unit <= 5; ++unit) all.push_back(result(1, unit, unit == 3 ? 500 : 100));
    for (const Status& status : w.group(std::move(all))) EXPECT_TRUE(status);
    EXPECT_EQ(w.results(), 5);
  }
}

TEST(Writer, AResultOfAJobThatIsGoneTakesNoPlace) {
  Writer w;
  std::vector<Operation> operations;
  operations.push_back(result(7, 1, 10));
  operations.push_back(result(1, 1, 10));
  const std::vector<Status> outcomes = w.group(std::move(operations));
  EXPECT_EQ(outcomes[0].error().message, "it has no place");
  EXPECT_TRUE(outcomes[1]);
  EXPECT_FALSE(fs::exists(w.spool() / "7"));
}

TEST(Writer, AGroupMayFillSeveralFiles) {
  Writer w({}, {}, 150);
  std::vector<Operation> operations;
  for (uint64_t unit = 1; unit <= 3; ++unit) operations.push_back(result(1, unit, 100));
  operations.push_back(result(1, 4, 5 << 20));  // more than is kept in memory
  for (const Status& status : w.group(std::move(operations))) EXPECT_TRUE(status);
  for (int file = 1; file <= 4; ++file)
    EXPECT_TRUE(fs::exists(w.spool() / "1" / ("1-" + std::to_string(file) + ".spool"))) << file;
  EXPECT_FALSE(fs::exists(w.spool() / "1" / "1-5.spool"));
  EXPECT_EQ(w.results(), 4);
}

TEST(Writer, AJobWhoseFilesCannotBeMadeFailsAlone) {
  Writer w;
  fs::create_directories(w.spool());
  ASSERT_TRUE(write_file_atomic(w.spool() / "1", std::string_view("a file where a folder should be")));
  std::vector<Operation> operations;
  operations.push_back(result(1, 1, 10));
  operations.push_back(pass(1));
  const std::vector<Status> outcomes = w.group(std::move(operations));
  EXPECT_EQ(outcomes[0].error().kind, ErrorKind::kIo);
  EXPECT_TRUE(outcomes[1]);
  EXPECT_EQ(w.results(), 0);
  EXPECT_EQ(w.passes(), 1);
}

TEST(Writer, WhatRemovesRunsThoughTheLogIsOverItsBound) {
  StoreOptions options;
  options.wal_bytes = 1;
  Writer w(options);
  Operation last = pass(1);
  last.after = [&]() -> Status {
    w.disk().arm(Fault::kWriteError, 0, 1 << 20);  // the log cannot be emptied
    return {};
  };
  EXPECT_TRUE(w.alone(std::move(last)));
  EXPECT_EQ(w.alone(pass(2)).error().kind, ErrorKind::kIo);
  Operation removes;
  removes.removes = true;
  removes.apply = [&](GroupTransaction& t) -> Status {
    w.disk().arm(Fault::kNone, 0, 0);
    return t.tables().drop_results(1);
  };
  EXPECT_TRUE(w.alone(std::move(removes)));
  EXPECT_EQ(w.passes(), 0);
  EXPECT_TRUE(w.alone(pass(3)));
}

TEST(Writer, AnOperationSeesWhatTheOnesBeforeItChanged) {
  Writer w;
  std::vector<Operation> operations(3);
  JobRecord second = sample_job("second");
  second.id = 2;
  operations[0].apply = [&](GroupTransaction& t) -> Status {
    EXPECT_TRUE(t.has_job(1) && t.job(1) && !t.has_job(2) && !t.worker("w"));
    EXPECT_EQ(t.jobs().size(), 1u);
    t.set_job(second);
    WorkerRecord worker;
    worker.identity = "w";
    t.set_worker(worker);
    return {};
  };
  operations[1].apply = [&](GroupTransaction& t) -> Status {
    EXPECT_TRUE(t.has_job(2) && t.worker("w"));
    EXPECT_EQ(*t.job(2), second);
    EXPECT_EQ(t.jobs().size(), 2u);
    t.remove_job(1);
    return {};
  };
  operations[2].apply = [&](GroupTransaction& t) -> Status {
    EXPECT_FALSE(t.has_job(1) || t.job(1));
    EXPECT_EQ(t.jobs().size(), 1u);
    return {};
  };
  for (const Status& status : w.group(std::move(operations))) EXPECT_TRUE(status);
}

}  // namespace
}  // namespace kiln::test

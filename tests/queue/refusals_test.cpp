// What the store refuses, and what it does with things that are not there.
#include "common/base/files.h"
#include "coordinator/farm/queue/row_windows.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

struct Opened {
  MemoryDir dir;
  std::unique_ptr<Store> store = open_store(dir.path());
  JobId job = *store->submit(sample_job());

  void expect_invalid(const Status& status, const char* words) {
    ASSERT_FALSE(status) << words;
    EXPECT_EQ(status.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(status.error().message.find(words), std::string::npos) << status.error().message;
  }
};

TEST(Refusals, AWorkersRecordHasItsBounds) {
  Opened o;
  WorkerRecord most;
  most.identity.assign(256, 'a');
  most.quarantine_reason.assign(4096, 'r');
  most.numeric_classes.assign(64, "c");
  EXPECT_TRUE(wait_for([&](auto done) { o.store->put_worker(most, done); }));
  EXPECT_EQ(*o.store->worker(most.identity), most);
  const auto refuse = [&](auto change) {
    WorkerRecord beyond = most;
    change(beyond);
    o.expect_invalid(wait_for([&](auto done) { o.store->put_worker(beyond, done); }), "is too long");
  };
  refuse([](WorkerRecord& w) { w.identity.clear(); });
  refuse([](WorkerRecord& w) { w.identity += 'a'; });
  refuse([](WorkerRecord& w) { w.quarantine_reason += 'r'; });
  refuse([](WorkerRecord& w) { w.numeric_classes.push_back("c"); });
  EXPECT_EQ(o.store->workers().size(), 1u);
}

TEST(Refusals, TrustIsNotedOfNamesThatCanBeStored) {
  Opened o;
  for (const std::string& name : {std::string(), std::string(257, 'a')}) {
    o.expect_invalid(wait_for([&](auto done) { o.store->note_trust(name, 1, 5, done); }), "identity");
    o.expect_invalid(wait_for([&](auto done) { o.store->quarantine(name, "it lied", 5, done); }), "identity");
  }
  EXPECT_TRUE(o.store->workers().empty());
  for (const int64_t at : {5, 6})
    EXPECT_TRUE(wait_for([&](auto done) { o.store->note_trust("render7", 1, at, done); }));
  EXPECT_EQ(o.store->worker("render7")->first_seen_ms, 5);
  EXPECT_EQ(o.store->worker("render7")->last_seen_ms, 6);
}

// A job's taint says each thing once, and ends before it is too long to be stored.
TEST(Refusals, ATaintHasItsBound) {
  Opened o;
  const auto conclude = [&](const std::string& worker) {
    EXPECT_TRUE(commit_now(*o.store, o.job, 1));
    const Digest digest = rows_of(*o.store, o.job).front().digest;
    EXPECT_TRUE(wait_for([&](auto done) { o.store->settle(o.job, 1, digest, false, worker, done); }));
    const auto nothing = [](JobRecord&) { return Status(); };
    EXPECT_TRUE(o.store->conclude(o.job, nothing));
    return o.store->job(o.job)->taint;
  };
  const auto quarantine = [&](const std::string& worker, size_t size) {
    EXPECT_TRUE(wait_for([&](auto done) { o.store->quarantine(worker, std::string(size, 'x'), 5, done); }));
  };
  EXPECT_TRUE(o.store->change(o.job, [](JobRecord& j) -> Status {
    j.taint.clear();
    return {};
  }));
  EXPECT_EQ(conclude("honest"), "");
  quarantine("one", 10);
  const std::string once = conclude("one");
  EXPECT_EQ(once.rfind("1 ", 0), 0u) << once;
  EXPECT_EQ(conclude("one"), once);
  quarantine("two", 4000);
  EXPECT_EQ(conclude("two"), once);
  EXPECT_TRUE(o.store->job(o.job)->tainted);
}

TEST(Refusals, ChangesOfJobsThatAreNotThere) {
  Opened o;
  o.expect_invalid(wait_for([&](auto done) { o.store->pin_class(99, "avx2", done); }), "no job 99");
  o.expect_invalid(o.store->forget(99), "no job 99");
  o.store->event(99, 1, "of nobody");
  o.store->event(o.job, 1, std::string(5000, 'x'));
  EXPECT_TRUE(o.store->flush());
  EXPECT_TRUE(o.store->events(99)->empty());
  ASSERT_EQ(o.store->events(o.job)->size(), 1u);
  EXPECT_EQ(o.store->events(o.job)->front().text.size(), 4096u);
}

TEST(Refusals, EachPartOfADescriptionIsStored) {
  Opened o;
  JobRecord job = sample_job();
  job.after = {o.job};
  job.id = *o.store->submit(job);
  const auto change = [&](auto part) {
    part(job);
    ASSERT_TRUE(o.store->update(job));
  };
  change([](JobRecord& j) { j.scene = j.inputs.back().path; });
  change([](JobRecord& j) { j.settings = "{}"; });
  change([](JobRecord& j) { j.after.clear(); });
  change([](JobRecord& j) { j.inputs.push_back({"more", {}, 1}); });
  o.store->close();
  EXPECT_EQ(*open_store(o.dir.path())->job(job.id), job);
}

TEST(Refusals, AResultMayBeEmptyButNotOfAnySize) {
  Opened o;
  UnitCommit commit = sample_commit(o.job, 1, {});
  EXPECT_TRUE(wait_for([&](auto done) { o.store->commit_result(commit, nullptr, done); }));
  EXPECT_EQ(o.store->read_result(o.job, 1, commit.digest)->size(), 0u);
  const auto large = std::make_shared<const Bytes>(kMaxPayloadBytes + 1);
  o.expect_invalid(wait_for([&](auto done) { o.store->commit_result(commit, large, done); }), "are allowed");
}

// Both are in one group: the second's bytes were on the disk when it began, and are not when its turn comes.
TEST(Refusals, AResultThatIsReplacedByOneOfAnotherShapeMayBeGivenAgain) {
  Opened o;
  const auto payload = std::make_shared<const Bytes>(sample_payload(1, 64));
  const UnitCommit before = sample_commit(o.job, 1, *payload);
  UnitCommit other = before;
  ++other.shape;
  ASSERT_TRUE(commit_now(*o.store, before, *payload));
  std::promise<void> go;
  o.store->put_pass(o.job, {1, 1}, [&](Status) { go.get_future().wait(); });
  std::promise<Status> first, second;
  o.store->commit_result(other, payload, [&](Status status) { first.set_value(std::move(status)); });
  o.store->commit_result(before, payload, [&](Status status) { second.set_value(std::move(status)); });
  go.set_value();
  EXPECT_TRUE(first.get_future().get());
  EXPECT_TRUE(second.get_future().get());
  ASSERT_EQ(rows_of(*o.store, o.job).size(), 1u);
  EXPECT_EQ(rows_of(*o.store, o.job)[0].shape, before.shape);
  EXPECT_EQ(*o.store->read_result(o.job, 1, before.digest), *payload);
}

TEST(Refusals, ARowOfAWindowWhoseRecordRottedIsReadFromTheTable) {
  Opened o;
  for (uint64_t unit = 1; unit <= 2; ++unit) ASSERT_TRUE(commit_now(*o.store, o.job, unit));
  const auto read = [&](uint64_t unit) {
    return o.store->read_result(o.job, unit, sha256(sample_payload(unit, 100)));
  };
  ASSERT_TRUE(read(1));
  fs::remove(o.dir.path() / "spool" / std::to_string(o.job) / "1-1.spool");
  const auto gone = read(2);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, ErrorKind::kIo);
  EXPECT_NE(gone.error().message.find("cannot open"), std::string::npos) << gone.error().message;
}

TEST(Refusals, AStoreThatIsClosedHasNoLog) {
  Opened o;
  EXPECT_GT(o.store->wal_size(), 0u);
  o.store->close();
  EXPECT_EQ(o.store->wal_size(), 0u);
}

TEST(Refusals, AProbeThatCannotWriteItsFileSaysSo) {
  Opened o;
  EXPECT_TRUE(o.store->probe());
  fs::create_directories(o.dir.path() / "spool" / "probe" / "x");
  const Status probe = o.store->probe();
  ASSERT_FALSE(probe);
  EXPECT_NE(probe.error().message.find("cannot create"), std::string::npos) << probe.error().message;
}

TEST(Windows, AreKeptOfSixtyFourJobs) {
  RowWindows windows;
  CommitRow row;
  row.unit = 5;
  for (JobId job = 1; job <= 64; ++job) windows.put(job, {row});
  windows.put(3, {row});
  EXPECT_TRUE(windows.find(1, 5, {}));
  windows.put(65, {row});
  EXPECT_FALSE(windows.find(1, 5, {}));
  for (JobId job = 2; job <= 65; ++job) EXPECT_TRUE(windows.find(job, 5, {})) << job;
  EXPECT_FALSE(windows.find(2, 6, {}));
}

}  // namespace
}  // namespace kiln::test

// The store without faults: what goes in comes out, after a restart too.
#include "coordinator/farm/queue/store.h"

#include <atomic>
#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "coordinator/farm/queue/schema.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

TEST(Store, JobsComeBackWholeAndIdsAreNeverUsedAgain) {
  const TempDir dir;
  JobRecord job = sample_job();
  {
    const auto store = open_store(dir.path() / "a" / "b");
    ASSERT_TRUE(store);
    EXPECT_EQ(store->epoch(), 1u);
    const auto first = store->submit(job);
    ASSERT_TRUE(first) << first.error().message;
    job.after = {*first};
    job.submission = "another";
    const auto second = store->submit(job);
    ASSERT_TRUE(second);
    EXPECT_GT(*second, *first);
    job.id = *second;
    job.state = JobState::kDone;
    ASSERT_TRUE(store->update(job));
    job.results.push_back({"report.json", sha256(bytes_of("x")), 1});
    ASSERT_TRUE(store->update(job));
    EXPECT_EQ(*store->job(*second), job);
  }
  {
    const auto store = open_store(dir.path() / "a" / "b");
    ASSERT_TRUE(store);
    EXPECT_EQ(store->epoch(), 2u);
    ASSERT_EQ(store->jobs().size(), 2u);
    EXPECT_EQ(*store->job(job.id), job);
    ASSERT_TRUE(store->forget(job.id));
    EXPECT_FALSE(store->job(job.id));
  }
  const auto store = open_store(dir.path() / "a" / "b");
  job.after.clear();
  job.submission = "a third";
  const auto third = store->submit(job);
  ASSERT_TRUE(third);
  EXPECT_GT(*third, job.id);
}

TEST(Store, TheSameSubmissionIsTheSameJob) {
  const TempDir dir;
  JobRecord job = sample_job();
  JobId first = 0;
  {
    const auto store = open_store(dir.path());
    first = *store->submit(job);
    EXPECT_EQ(*store->submit(job), first);
    JobRecord other = job;
    other.user = "grace";  // draws from its own numbers
    EXPECT_NE(*store->submit(other), first);
  }
  const auto store = open_store(dir.path());
  EXPECT_EQ(*store->submit(job), first);
  job.submission.clear();
  EXPECT_NE(*store->submit(job), first);
  EXPECT_EQ(store->jobs().size(), 3u);
}

TEST(Store, ChangesAreMadeInPlaceOrNotAtAll) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const JobId id = *store->submit(sample_job());
  ASSERT_TRUE(wait_for([&](auto done) { store->pin_class(id, "avx512 77", done); }));
  ASSERT_TRUE(store->change(id, [](JobRecord& j) -> Status {
    j.priority = 9;
    return {};
  }));
  EXPECT_EQ(store->job(id)->numeric_class, "avx512 77");
  EXPECT_EQ(store->job(id)->priority, 9);
  const Status refused = store->change(id, [](JobRecord& j) -> Status {
    j.priority = 10;
    return fail(ErrorKind::kUsage, "no");
  });
  EXPECT_FALSE(refused);
  EXPECT_FALSE(store->change(id, [](JobRecord& j) -> Status {
    j.priority = 1000;
    return {};
  }));
  EXPECT_EQ(store->job(id)->priority, 9);
}

TEST(Store, OneAnswerIsTakenBackAndTheOtherStays) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  const Bytes right = sample_payload(1, 50), wrong = sample_payload(2, 50);
  ASSERT_TRUE(commit_now(*store, sample_commit(job, 9, right), right));
  ASSERT_TRUE(commit_now(*store, sample_commit(job, 9, wrong), wrong));
  ASSERT_TRUE(wait_for([&](auto done) { store->revoke_answer(job, 9, sha256(wrong), done); }));
  ASSERT_TRUE(wait_for([&](auto done) { store->revoke_answer(job, 9, sha256(wrong), done); }));
  ASSERT_TRUE(wait_for([&](auto done) { store->settle(job, 9, sha256(right), true, "render3", done); }));
  const auto rows = rows_of(*store, job);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].digest, sha256(right));
  EXPECT_EQ(rows[0].worker, "render3");
  EXPECT_TRUE(rows[0].verified);
}

TEST(Store, AQuarantineTaintsWhatOnlyThatWorkerGave) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const auto concluded = [&](const std::string& worker, bool verified) {
    JobRecord record = sample_job();
    record.tainted = false;
    record.taint.clear();
    const JobId job = *store->submit(record);
    EXPECT_TRUE(commit_now(*store, job, 1));
    const Digest digest = rows_of(*store, job).front().digest;
    EXPECT_TRUE(wait_for([&](auto done) { store->settle(job, 1, digest, verified, worker, done); }));
    EXPECT_TRUE(store->conclude(job, [](JobRecord& j) -> Status {
      j.state = JobState::kDone;
      return {};
    }));
    EXPECT_TRUE(rows_of(*store, job).empty());
    return job;
  };
  const JobId alone = concluded("liar", false), confirmed = concluded("liar", true),
              others = concluded("honest", false);
  EXPECT_FALSE(store->job(alone)->tainted);
  ASSERT_TRUE(wait_for([&](auto done) { store->quarantine("liar", "it lied", 5, done); }));
  EXPECT_TRUE(store->job(alone)->tainted);
  EXPECT_NE(store->job(alone)->taint.find("it lied"), std::string::npos);
  EXPECT_FALSE(store->job(confirmed)->tainted);
  EXPECT_FALSE(store->job(others)->tainted);
  // Quarantined before the job ends.
  EXPECT_TRUE(store->job(concluded("liar", false))->tainted);
  ASSERT_TRUE(wait_for([&](auto done) { store->note_trust("honest", 12, 6, done); }));
  EXPECT_EQ(store->worker("honest")->good_verifications, 12u);
}

TEST(Store, RefusesWhatCannotBe) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const auto refused = [&](auto change, const char* word) {
    JobRecord job = sample_job();
    change(job);
    const auto id = store->submit(job);
    ASSERT_FALSE(id) << word;
    EXPECT_EQ(id.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(id.error().message.find(word), std::string::npos) << id.error().message;
  };
  refused([](JobRecord& j) { j.priority = 101; }, "priority");
  refused([](JobRecord& j) { j.quorum = 0; }, "quorum");
  refused([](JobRecord& j) { j.scene = "other.gltf"; }, "other.gltf");
  refused([](JobRecord& j) { j.after = {77}; }, "77");
  refused([](JobRecord& j) { j.name = "a\nb"; }, "name");
  refused([](JobRecord& j) { j.inputs.push_back(j.inputs[0]); }, "twice");
  for (const char* path : {"../x", "/etc/passwd", "a//b", "a/../../b", "", ".", "a/", "a\nb"})
    refused([&](JobRecord& j) { j.inputs.push_back({path, {}, 1}); }, "relative path");

  JobRecord job = sample_job();
  job.id = 12;
  EXPECT_FALSE(store->update(job));
  const JobId id = *store->submit(sample_job());
  job = *store->job(id);
  job.after = {id};
  EXPECT_FALSE(store->update(job));  // itself
  EXPECT_FALSE(commit_now(*store, id + 1, 1));
  EXPECT_FALSE(wait_for([&](auto done) { store->put_pass(id + 1, {0, 1}, done); }));
  EXPECT_EQ(store->jobs().size(), 1u);
}

TEST(Store, ResultsOfAUnit) {
  const TempDir dir;
  const Bytes right = sample_payload(1, 5000), wrong = sample_payload(2, 10);
  JobId job = 0;
  UnitCommit commit;
  {
    const auto store = open_store(dir.path());
    job = *store->submit(sample_job());
    commit = sample_commit(job, 9, right);
    ASSERT_TRUE(commit_now(*store, commit, right));
    ASSERT_TRUE(commit_now(*store, commit, right));  // the same again: once
    UnitCommit other = sample_commit(job, 9, wrong);
    ASSERT_TRUE(commit_now(*store, other, wrong));
    ASSERT_TRUE(commit_now(*store, job, 3, 0));
    EXPECT_EQ(store->commits(job)->size(), 3u);
    commit.verified = true;
    ASSERT_TRUE(commit_now(*store, commit, right));
    commit.verified = false;
    ASSERT_TRUE(commit_now(*store, commit, right));  // is not taken back
    EXPECT_FALSE(
        wait_for([&](auto done) { store->settle(job, 9, sha256(bytes_of("nobody's")), false, "", done); }));
    EXPECT_EQ(store->commits(job)->size(), 3u);
    ASSERT_TRUE(wait_for([&](auto done) { store->settle(job, 9, commit.digest, false, "", done); }));
  }
  const auto store = open_store(dir.path());
  const auto rows = store->commits(job);
  ASSERT_TRUE(rows);
  ASSERT_EQ(rows->size(), 2u);
  EXPECT_EQ((*rows)[0].unit, 3u);
  EXPECT_FALSE((*rows)[0].settled);
  const CommitRow& row = (*rows)[1];
  EXPECT_EQ(row.unit, 9u);
  EXPECT_EQ(row.shape, commit.shape);
  EXPECT_EQ(row.digest, commit.digest);
  EXPECT_EQ(row.worker, commit.worker);
  EXPECT_TRUE(row.verified);
  EXPECT_TRUE(row.settled);
  EXPECT_EQ(*store->read_result(row), right);
  EXPECT_EQ(*store->read_result(job, 9, commit.digest), right);
  EXPECT_EQ(store->read_result((*rows)[0])->size(), 0u);
  EXPECT_EQ(store->read_result(job, 9, sha256(wrong)).error().kind, ErrorKind::kInvalidInput);

  ASSERT_TRUE(wait_for([&](auto done) { store->revoke(job, {9, 10}, done); }));
  EXPECT_EQ(store->commits(job)->size(), 1u);
  ASSERT_TRUE(commit_now(*store, commit, right));  // runs again
  EXPECT_EQ(store->commits(job)->size(), 2u);
  EXPECT_EQ(*store->read_result(job, 9, commit.digest), right);
}

TEST(Store, PassesEventsAndWorkersComeBack) {
  const TempDir dir;
  StoreOptions options;
  options.events_per_job = 4;
  WorkerRecord worker{"render-7", 5, 6, 64, {"avx2-1", "avx512-9"}, 11, 12, 13, true, "it lied"};
  JobId job = 0, quiet = 0;
  {
    const auto store = open_store(dir.path(), options);
    job = *store->submit(sample_job());
    quiet = *store->submit(sample_job());
    for (int i = 0; i < 9; ++i) store->event(job, 1000 + i, "event " + std::to_string(i));
    store->event(quiet, 1, "alone");
    ASSERT_TRUE(wait_for([&](auto done) { store->put_pass(job, {1, 256}, done); }));
    ASSERT_TRUE(wait_for([&](auto done) { store->put_pass(job, {0, 128}, done); }));
    ASSERT_TRUE(wait_for([&](auto done) { store->put_pass(job, {0, 128}, done); }));
    const Status other = wait_for([&](auto done) { store->put_pass(job, {0, 64}, done); });
    ASSERT_FALSE(other);
    EXPECT_NE(other.error().message.find("128"), std::string::npos);
    ASSERT_TRUE(wait_for([&](auto done) {
      WorkerRecord b;
      b.identity = "b";
      store->put_worker(b, done);
    }));
    ASSERT_TRUE(wait_for([&](auto done) { store->put_worker(worker, done); }));
  }
  const auto store = open_store(dir.path(), options);
  EXPECT_EQ(*store->passes(job), (std::vector<PassRecord>{{0, 128}, {1, 256}}));
  const auto events = store->events(job);
  ASSERT_EQ(events->size(), 4u);
  EXPECT_EQ(events->front().text, "event 5");
  EXPECT_EQ(events->back().at_ms, 1008);
  EXPECT_EQ(store->events(quiet)->size(), 1u);
  ASSERT_EQ(store->workers().size(), 2u);
  EXPECT_EQ(*store->worker("render-7"), worker);
  ASSERT_TRUE(store->forgive("render-7"));
  worker.quarantined = false;
  worker.quarantine_reason.clear();
  worker.good_verifications = worker.failures = 0;
  EXPECT_EQ(*store->worker("render-7"), worker);
  EXPECT_FALSE(store->forgive("nobody"));
}

TEST(Store, CallbacksRunInTheOrderOfTheQueueAndSeeWhatCameBefore) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  std::vector<int> order;  // by the writer thread alone
  const auto note = [&](int i) {
    return [&order, i](Status status) {
      EXPECT_TRUE(status);
      order.push_back(i);
    };
  };
  int given = 0;
  for (uint64_t unit = 0; unit < 500; ++unit) {
    const Bytes payload = sample_payload(unit, 64);
    const UnitCommit commit = sample_commit(job, unit, payload);
    const auto bytes = std::make_shared<const Bytes>(payload);
    store->commit_result(commit, bytes, note(given++));
    if (unit % 3 == 0) {
      store->revoke(job, {unit}, note(given++));
      // In the group of the row that it finds on the disk, and that is gone when its turn comes.
      store->commit_result(commit, bytes, note(given++));
    }
    store->settle(job, unit, commit.digest, false, "", note(given++));
    if (unit == 250) store->drop_results(job, note(given++));
  }
  ASSERT_TRUE(store->flush());
  ASSERT_EQ(order.size(), static_cast<size_t>(given));
  for (int i = 0; i < given; ++i) ASSERT_EQ(order[i], i);
  const auto rows = store->commits(job);
  ASSERT_EQ(rows->size(), 249u);
  for (const CommitRow& row : *rows) {
    EXPECT_TRUE(row.settled);
    EXPECT_EQ(*store->read_result(row), sample_payload(row.unit, 64));
  }
  EXPECT_TRUE(store->check()->empty());
}

// The result is on the disk when the group begins, and is gone when its turn comes to be stored again.
TEST(Store, AResultThatIsRevokedAndGivenAgainInOneGroup) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  const auto payload = std::make_shared<const Bytes>(sample_payload(1, 64));
  const UnitCommit commit = sample_commit(job, 1, *payload);
  ASSERT_TRUE(commit_now(*store, commit, *payload));
  // The writer is kept busy until both are queued.
  std::promise<void> go;
  store->put_pass(job, {1, 1}, [&](Status) { go.get_future().wait(); });
  store->revoke(job, {1}, nullptr);
  std::promise<Status> again;
  store->commit_result(commit, payload, [&](Status status) { again.set_value(std::move(status)); });
  go.set_value();
  const Status status = again.get_future().get();
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(*store->read_result(job, 1, commit.digest), *payload);
}

TEST(Store, ManyThreadsAtOnce) {
  const TempDir dir;
  StoreOptions options;
  options.spool_file_bytes = 20000;
  const auto store = open_store(dir.path(), options);
  std::vector<JobId> jobs;
  for (int i = 0; i < 4; ++i) jobs.push_back(*store->submit(sample_job()));
  std::atomic<int> good{0};
  std::vector<std::thread> threads;
  for (size_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (uint64_t unit = 0; unit < 200; ++unit) {
        const Bytes payload = sample_payload(unit, 300);
        store->commit_result(sample_commit(jobs[t], unit, payload), std::make_shared<const Bytes>(payload),
                             [&](Status status) { good += status ? 1 : 0; });
        if (unit % 50 == 0) (void)store->commits(jobs[(t + 1) % 4]);
        if (unit % 20 == 0) (void)store->jobs();
      }
    });
  for (std::thread& thread : threads) thread.join();
  ASSERT_TRUE(store->flush());
  EXPECT_EQ(good, 800);
  EXPECT_TRUE(store->check()->empty());
  size_t files = 0;
  for (const auto& file : fs::directory_iterator(dir.path() / "spool" / std::to_string(jobs[0]))) {
    ++files;
    EXPECT_LE(file.file_size(), options.spool_file_bytes);
  }
  EXPECT_GT(files, 3u);  // 200 x 388 bytes: rolled
}

TEST(Store, ForgettingRemovesAllOfAJobAndNothingElse) {
  const TempDir dir;
  const auto store = open_store(dir.path());
  JobRecord done = sample_job();
  done.submission.clear();
  done.state = JobState::kDone;
  done.ended_ms = 100;
  const JobId old_job = *store->submit(done);
  const JobId awaited = *store->submit(done);
  done.ended_ms = 200;
  const JobId young = *store->submit(done);
  JobRecord waiting = sample_job();
  waiting.state = JobState::kWaiting;
  waiting.after = {awaited};
  waiting.ended_ms = 0;
  const JobId waits = *store->submit(waiting);
  for (const JobId job : {old_job, young, waits}) {
    ASSERT_TRUE(commit_now(*store, job, 1));
    store->event(job, 1, "x");
  }
  EXPECT_EQ(store->forget(waits).error().kind, ErrorKind::kUsage);
  EXPECT_EQ(store->forget(awaited).error().kind, ErrorKind::kUsage);
  EXPECT_EQ(*store->forget_ended(200), std::vector<JobId>{old_job});
  EXPECT_EQ(store->jobs().size(), 3u);
  EXPECT_TRUE(store->commits(old_job)->empty());
  EXPECT_TRUE(store->events(old_job)->empty());
  EXPECT_FALSE(fs::exists(dir.path() / "spool" / std::to_string(old_job)));
  EXPECT_EQ(store->commits(young)->size(), 1u);
  EXPECT_EQ(store->events(waits)->size(), 1u);
  EXPECT_TRUE(store->check()->empty());
}

TEST(Store, OneCoordinatorForAFolder) {
  const TempDir dir;
  const auto first = open_store(dir.path());
  ASSERT_TRUE(first);
  const auto second = Store::open(dir.path(), {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::kUnavailable);
  EXPECT_NE(second.error().message.find("process " + std::to_string(::getpid()) + " on "), std::string::npos)
      << second.error().message;
  ASSERT_TRUE(first->submit(sample_job()));
  first->close();
  EXPECT_EQ(first->submit(sample_job()).error().kind, ErrorKind::kUnavailable);
  EXPECT_EQ(open_store(dir.path())->jobs().size(), 1u);
}

std::vector<std::pair<fs::path, Bytes>> contents(const fs::path& folder) {
  std::vector<std::pair<fs::path, Bytes>> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    all.emplace_back(entry.path(), entry.is_regular_file() ? *read_file(entry.path()) : Bytes());
  std::sort(all.begin(), all.end());
  return all;
}

void overwrite(const fs::path& path, uint64_t offset, const std::string& bytes) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(offset));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

TEST(Store, LeavesAFolderAloneThatItCannotOpen) {
  const TempDir dir;
  const fs::path database = dir.path() / "kiln.db";
  {
    const auto store = open_store(dir.path());
    ASSERT_TRUE(commit_now(*store, *store->submit(sample_job()), 1));
  }
  fs::remove(dir.path() / "lock");
  const auto refused = [&](const char* word) {
    const auto before = contents(dir.path());
    const auto store = Store::open(dir.path(), {});
    ASSERT_FALSE(store) << word;
    EXPECT_NE(store.error().message.find(word), std::string::npos) << store.error().message;
    EXPECT_EQ(contents(dir.path()), before) << word;
  };
  const Bytes good = *read_file(database);
  overwrite(database, 60, std::string("\0\0\0\x63", 4));  // user version 99
  refused("newer release");
  overwrite(database, 60, std::string("\0\0\0\1", 4));
  overwrite(database, 68, "ABCD");  // application
  refused("another program");
  ASSERT_TRUE(
      write_file_atomic(database, std::string_view("no database at all, but a long enough text ......"
                                                   "....................................................")));
  refused("not a database");
  Bytes damaged = good;  // a page of the tables
  for (size_t i = 4096; i < 8192; ++i) damaged[i] = std::byte{0x5a};
  ASSERT_TRUE(write_file_atomic(database, damaged));
  refused("kiln.db");
  ASSERT_TRUE(write_file_atomic(database, good));
  EXPECT_EQ(open_store(dir.path())->jobs().size(), 1u);

  // A folder that was not there is not there.
  const fs::path file = dir.path() / "file";
  ASSERT_TRUE(write_file_atomic(file, std::string_view("x")));
  EXPECT_FALSE(Store::open(file / "store", {}));
  const auto locked = dir.path() / "new" / "kiln.db";
  fs::create_directories(locked);  // a folder where the database should be
  EXPECT_FALSE(Store::open(dir.path() / "new", {}));
  EXPECT_EQ(contents(dir.path() / "new").size(), 1u);
}

// Pages of results are checked after the opening, and from then on nothing is built on them.
TEST(Store, ADamagedTableOfResultsIsFoundLate) {
  const MemoryDir dir;
  const fs::path database = dir.path() / "kiln.db";
  JobId job = 0;
  {
    const auto store = open_store(dir.path());
    job = *store->submit(sample_job());
    for (uint64_t unit = 0; unit < 600; ++unit) ASSERT_TRUE(commit_now(*store, job, unit, 8));
  }
  // An interior page of the table: its last child points beyond the file.
  Bytes bytes = *read_file(database);
  size_t damaged = 0;
  for (size_t page = 4096; page < bytes.size(); page += 4096)
    if (bytes[page] == std::byte{2} && ++damaged) bytes[page + 8] = std::byte{0x7f};
  ASSERT_GT(damaged, 0u);
  ASSERT_TRUE(write_file_atomic(database, bytes));
  const auto store = Store::open(dir.path(), {});
  ASSERT_TRUE(store) << store.error().message;
  const Status late = (*store)->compact();
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().kind, ErrorKind::kIo);
  EXPECT_NE(late.error().message.find("is damaged"), std::string::npos) << late.error().message;
  EXPECT_NE(late.error().message.find("restore it from a copy"), std::string::npos);
  EXPECT_EQ((*store)->submit(sample_job()).error().message, late.error().message);
  EXPECT_EQ((*store)->probe().error().message, late.error().message);
  EXPECT_EQ((*store)->jobs().size(), 1u);  // what there is can be read
}

TEST(Store, ResultsReadInOrderAreTheStoredOnes) {
  const MemoryDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  const auto digest = [](uint64_t unit) { return sha256(sample_payload(unit, 20)); };
  for (uint64_t unit = 0; unit < 600; ++unit) ASSERT_TRUE(commit_now(*store, job, unit, 20));
  for (uint64_t unit = 0; unit < 600; ++unit) {
    const auto payload = store->read_result(job, unit, digest(unit));
    ASSERT_TRUE(payload) << unit << payload.error().message;
    ASSERT_EQ(*payload, sample_payload(unit, 20));
    ASSERT_FALSE(store->read_result(job, unit, digest(unit + 1)));  // not its own
  }
  // Neither what is revoked, nor what was stored elsewhere since, comes from rows that were read before.
  ASSERT_TRUE(store->read_result(job, 10, digest(10)));
  ASSERT_TRUE(wait_for([&](auto done) { store->revoke(job, {11}, done); }));
  EXPECT_EQ(store->read_result(job, 11, digest(11)).error().kind, ErrorKind::kInvalidInput);
  ASSERT_TRUE(store->read_result(job, 10, digest(10)));
  ASSERT_TRUE(wait_for([&](auto done) { store->revoke_answer(job, 12, digest(12), done); }));
  EXPECT_EQ(store->read_result(job, 12, digest(12)).error().kind, ErrorKind::kInvalidInput);
  ASSERT_TRUE(store->read_result(job, 10, digest(10)));
  ASSERT_TRUE(wait_for([&](auto done) { store->drop_results(job, done); }));
  EXPECT_EQ(store->read_result(job, 13, digest(13)).error().kind, ErrorKind::kInvalidInput);
  ASSERT_TRUE(commit_now(*store, job, 13, 20));
  EXPECT_EQ(*store->read_result(job, 13, digest(13)), sample_payload(13, 20));
}

TEST(Store, AnOlderSchemaIsBroughtForwardInOneTransaction) {
  const TempDir dir;
  const char* const steps[] = {"CREATE TABLE a(x); INSERT INTO a VALUES(1);", "ALTER TABLE a ADD COLUMN y;",
                               "UPDATE a SET y=x+1;"};
  const auto value = [](Database& database) {
    Query query = database.ask("SELECT y FROM a");
    const auto row = query.next();
    return row && *row ? query.integer() : -1;
  };
  Database database = std::move(*Database::open(dir.path() / "x.db"));
  ASSERT_TRUE(migrate(database, std::span(steps).first(1)));
  const char* const broken[] = {steps[0], steps[1], "no statement"};
  EXPECT_FALSE(migrate(database, broken));
  EXPECT_EQ(value(database), -1);  // no column y
  EXPECT_EQ(read_database_header(dir.path() / "x.db")->user_version, 1u);
  ASSERT_TRUE(migrate(database, steps));
  ASSERT_TRUE(migrate(database, steps));  // nothing to do
  EXPECT_EQ(value(database), 2);
  EXPECT_EQ(migrate(database, std::span(steps).first(2)).error().kind, ErrorKind::kUsage);
  EXPECT_EQ(read_database_header(dir.path() / "x.db")->user_version, 3u);
}

TEST(Store, TheLogStaysBelowItsBound) {
  const TempDir dir;
  StoreOptions options;
  options.wal_bytes = 256 << 10;
  const auto store = open_store(dir.path(), options);
  JobRecord job = sample_job();
  job.settings = std::string(100000, ' ');  // 25 pages of 4 KiB, with their heads, and a few of the tree
  constexpr uint64_t kGroup = 40 * (4096 + 24);
  job.id = *store->submit(job);
  uint64_t most = 0;
  for (int i = 0; i < 100; ++i) {
    job.settings[i] = 'x';
    ASSERT_TRUE(store->update(job));
    most = std::max(most, store->wal_size());
  }
  EXPECT_LE(most, options.wal_bytes + kGroup);
  EXPECT_GT(most, options.wal_bytes / 2);
  ASSERT_TRUE(store->compact());
  EXPECT_EQ(store->wal_size(), 0u);
  EXPECT_EQ(*store->job(job.id), job);
}

}  // namespace
}  // namespace kiln::test

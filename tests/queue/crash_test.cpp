// A coordinator that is killed at any point: what it acknowledged is there, and nothing is broken.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {

// What the child says through the pipe: before it asks, and when it was told that it is done.
struct Word {
  enum Kind : uint64_t {
    kSubmitted,
    kUpdated,
    kCommitted,
    kAskedRevoke,
    kRevoked,
    kAskedDrop,
    kDropped,
    kPass
  };
  uint64_t kind, job, unit;
};

size_t size_of(uint64_t unit) {
  return unit % 7 == 0 ? 20000 : unit % 300;
}

// Submits, commits, revokes, updates and drops as fast as it can, without end.
[[noreturn]] void run_child(const std::filesystem::path& folder, int pipe, uint64_t round, FaultyDisk& disk) {
  StoreOptions options;
  options.faults = &disk;
  options.spool_file_bytes = 100000;
  options.wal_bytes = 64 << 10;
  auto opened = Store::open(folder, options);
  if (!opened) ::_exit(3);
  Store& store = **opened;
  const auto say = [&](Word::Kind kind, uint64_t job, uint64_t unit) {
    const Word word{kind, job, unit};
    if (::write(pipe, &word, sizeof word) != sizeof word) ::_exit(4);
  };
  for (uint64_t unit = round << 32;;) {
    const auto job = store.submit(sample_job("round " + std::to_string(round)));
    if (!job) ::_exit(5);
    say(Word::kSubmitted, *job, 0);
    store.put_pass(*job, {7, unit}, [&, job = *job, unit](Status s) {
      if (s) say(Word::kPass, job, unit);
    });
    for (int i = 0; i < 120; ++i, ++unit) {
      const auto payload = std::make_shared<const Bytes>(sample_payload(unit, size_of(unit)));
      const UnitCommit commit = sample_commit(*job, unit, *payload);
      store.commit_result(commit, payload, [&, job = *job, unit](Status s) {
        if (s) say(Word::kCommitted, job, unit);
      });
      if (i % 10 == 9) {
        say(Word::kAskedRevoke, *job, unit - 3);
        store.revoke(*job, {unit - 3}, [&, job = *job, unit](Status s) {
          if (s) say(Word::kRevoked, job, unit - 3);
        });
      }
      if (i % 30 == 29) {
        JobRecord record = *store.job(*job);
        record.units_done = unit;
        if (store.update(record)) say(Word::kUpdated, *job, unit);
      }
    }
    if (*job % 3 == 0) {
      say(Word::kAskedDrop, *job, 0);
      store.drop_results(*job, [&, job = *job](Status s) {
        if (s) say(Word::kDropped, job, 0);
      });
    }
  }
}

struct Acknowledged {
  std::map<JobId, uint64_t> jobs;  // the last update
  std::map<JobId, uint64_t> passes;
  std::map<JobId, std::set<uint64_t>> units, gone, unsure;
  std::set<JobId> dropped, dropping;

  void hear(const Word& w) {
    switch (w.kind) {
      case Word::kSubmitted:
        jobs[w.job] = sample_job().units_done;
        break;
      case Word::kUpdated:
        jobs[w.job] = w.unit;
        break;
      case Word::kCommitted:
        units[w.job].insert(w.unit);
        break;
      case Word::kAskedRevoke:
        unsure[w.job].insert(w.unit);
        break;
      case Word::kRevoked:
        gone[w.job].insert(w.unit);
        break;
      case Word::kAskedDrop:
        dropping.insert(w.job);
        break;
      case Word::kDropped:
        dropped.insert(w.job);
        break;
      case Word::kPass:
        passes[w.job] = w.unit;
        break;
    }
  }

  void expect_in(Store& store) const {
    const auto faults = store.check();
    ASSERT_TRUE(faults) << faults.error().message;
    for (const std::string& fault : *faults) ADD_FAILURE() << fault;
    for (const auto& [id, units_done] : jobs) {
      const auto job = store.job(id);
      ASSERT_TRUE(job) << "job " << id;
      EXPECT_GE(job->units_done, units_done % (uint64_t{1} << 40));
      EXPECT_EQ(job->inputs, sample_job().inputs);
      std::map<uint64_t, CommitRow> rows;
      for (const CommitRow& row : rows_of(store, id)) rows[row.unit] = row;
      if (dropped.count(id)) EXPECT_TRUE(rows.empty()) << id;
      const auto of = [id = id](const auto& map) {
        const auto it = map.find(id);
        return it == map.end() ? std::set<uint64_t>() : it->second;
      };
      const auto revoked = of(gone), perhaps = of(unsure);
      for (const uint64_t unit : revoked) EXPECT_FALSE(rows.count(unit)) << unit;
      if (dropping.count(id)) continue;
      for (const uint64_t unit : of(units)) {
        if (perhaps.count(unit)) continue;
        ASSERT_TRUE(rows.count(unit)) << "unit " << unit << " of job " << id << " was acknowledged";
        const auto payload = store.read_result(rows[unit]);
        ASSERT_TRUE(payload) << payload.error().message;
        EXPECT_EQ(*payload, sample_payload(unit, size_of(unit)));
      }
      if (const auto pass = passes.find(id); pass != passes.end()) {
        EXPECT_EQ(*store.passes(id), (std::vector<PassRecord>{{7, pass->second}}));
      }
    }
  }
};

// 100 lives of one folder. In even rounds the parent kills after a random number of acknowledgements, in odd
// ones the child ends itself at a random write or sync, in the middle of it.
TEST(StoreCrash, WhatWasAcknowledgedSurvivesAKillAtAnyPoint) {
  const MemoryDir dir;
  Acknowledged acknowledged;
  uint64_t heard = 0;
  for (uint64_t round = 0; round < 100; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    std::mt19937_64 random(round);
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(ends[0]);
      FaultyDisk disk;
      // About 40 changes are made before the first acknowledgement.
      if (round % 2) disk.arm(Fault::kDie, static_cast<int64_t>(random() % 400), 1);
      run_child(dir.path(), ends[1], round, disk);
    }
    ::close(ends[1]);
    const uint64_t most = round % 2 ? ~uint64_t{0} : 1 + random() % 400;
    Word word;
    uint64_t words = 0;
    while (::read(ends[0], &word, sizeof word) == sizeof word) {
      acknowledged.hear(word);
      if (++words == most) ::kill(child, SIGKILL);  // what is in the pipe was said all the same
    }
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << status;
    heard += words;

    if (round % 5 && round != 99) continue;  // the child opens what the one before left
    const auto store = open_store(dir.path());
    ASSERT_TRUE(store);
    acknowledged.expect_in(*store);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
    if (round % 20 == 0) {  // begin with less
      for (JobRecord job : store->jobs()) {
        job.state = JobState::kCancelled;
        job.ended_ms = 1;
        ASSERT_TRUE(store->update(job));
      }
      ASSERT_TRUE(store->forget_ended(2));
      acknowledged = {};
    }
  }
  EXPECT_GT(heard, 5000u);
}

}  // namespace
}  // namespace kiln::test

// Answers on a disk that fails: nothing is called stored that is not, nothing is lost, order is kept.
#include <atomic>
#include <condition_variable>

#include "coordinator/service/durable_results.h"
#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {

UnitResult result_of(uint64_t unit, double value) {
  UnitResult r;
  r.unit = unit;
  r.site_count = 2;
  r.plane_count = 1;
  r.moments = {value, -value};
  r.rays = 7;
  r.nonfinite = 1;
  r.nonfinite_texel = 5;
  r.nonfinite_sample = 6;
  r.seconds = 0.25;
  return r;
}

// Waits for what the writing thread does.
class Signals {
 public:
  void raise(const std::string& what) {
    const std::lock_guard lock(mutex_);
    seen_.push_back(what);
    changed_.notify_all();
  }
  bool wait(const std::string& what) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20),
                             [&] { return std::count(seen_.begin(), seen_.end(), what) > 0; });
  }
  size_t count(const std::string& what) {
    const std::lock_guard lock(mutex_);
    return static_cast<size_t>(std::count(seen_.begin(), seen_.end(), what));
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> seen_;
};

TEST(UnitResultBytes, ComeBackAndAreHeldAgainstTheirSizes) {
  const UnitResult r = result_of(3, 1.5);
  const Bytes bytes = write_result(r);
  const auto back = read_result(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(result_digest(*back), result_digest(r));
  EXPECT_EQ(back->rays, r.rays);
  EXPECT_EQ(back->nonfinite_sample, r.nonfinite_sample);
  EXPECT_EQ(back->seconds, r.seconds);
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(read_result(std::span(bytes).first(size))) << size;
}

TEST(DurableResults, AreCalledStoredOnceTheyAreAndReadBack) {
  const MemoryDir dir;
  const auto store = open_store(dir.path());
  const JobId job = *store->submit(sample_job());
  Signals signals;
  DurableResultStore results(*store, {[](const std::string&) {}, [](JobId, const std::string&) {}});
  const auto r = std::make_shared<const UnitResult>(result_of(1, 2));
  const Digest digest = result_digest(*r);
  results.pin_class(job, "avx2 x");
  results.put({1, "ada", job, 1, 11, digest, 1}, r, [&] { signals.raise("stored"); });
  results.settle({job, 1, digest, false, "grace"});
  ASSERT_TRUE(signals.wait("stored"));
  ASSERT_TRUE(results.drain(std::chrono::seconds(10)));
  const auto back = results.read(job, 1, digest);
  ASSERT_TRUE(back);
  EXPECT_EQ(result_digest(**back), digest);
  const auto rows = rows_of(*store, job);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_TRUE(rows[0].settled);
  EXPECT_EQ(rows[0].worker, "grace");
  EXPECT_EQ(store->job(job)->numeric_class, "avx2 x");
  EXPECT_EQ(results.stored(job), 1u);
  // Of a job that is not there: never stored, and what comes after is.
  results.put({1, "ada", job + 7, 1, 11, digest, 2}, r, [&] { signals.raise("wrong"); });
  results.put({1, "ada", job, 2, 11, digest, 3}, r, [&] { signals.raise("after"); });
  ASSERT_TRUE(signals.wait("after"));
  EXPECT_EQ(signals.count("wrong"), 0u);
}

TEST(DurableResults, WaitForADiskThatRefusesAndKeepTheirOrder) {
  for (const Fault fault : {Fault::kNoSpace, Fault::kWriteError, Fault::kSyncError}) {
    const MemoryDir dir;
    FaultyDisk disk;
    StoreOptions options;
    options.faults = &disk;
    const auto store = open_store(dir.path(), options);
    const JobId job = *store->submit(sample_job());
    Signals signals;
    DurableResultStore results(*store,
                               {[&](const std::string& r) { signals.raise(r.empty() ? "works" : "held"); },
                                [](JobId, const std::string&) {}});
    const auto first = std::make_shared<const UnitResult>(result_of(1, 1)),
               second = std::make_shared<const UnitResult>(result_of(1, 2));
    disk.arm(fault, 0, 1 << 30);
    results.put({1, "a", job, 1, 11, result_digest(*first), 1}, first, [&] { signals.raise("first"); });
    ASSERT_TRUE(signals.wait("held"));
    // A revocation that is given while the answer waits comes after it.
    results.revoke({job, 1, result_digest(*first)});
    results.put({2, "b", job, 1, 11, result_digest(*second), 2}, second, [&] { signals.raise("second"); });
    EXPECT_EQ(signals.count("first") + signals.count("second"), 0u);
    EXPECT_FALSE(results.drain(std::chrono::milliseconds(300)));
    disk.arm(Fault::kNone, 0, 0);
    ASSERT_TRUE(signals.wait("works"));
    ASSERT_TRUE(signals.wait("second"));
    EXPECT_EQ(signals.count("first"), 1u);
    ASSERT_TRUE(results.drain(std::chrono::seconds(10)));
    const auto rows = rows_of(*store, job);
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0].digest, result_digest(*second));
  }
}

}  // namespace
}  // namespace kiln::test

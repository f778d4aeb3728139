#include "worker/agent/disk_cache.h"

#include <signal.h>
#include <sys/resource.h>

#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

using namespace test;

Bytes filled(size_t size, int value) {
  return Bytes(size, std::byte(value));
}

fs::path file_of(const TempDir& dir, const Digest& id) {
  return dir.path() / "chunks" / id.hex().substr(0, 2) / id.hex();
}

size_t files_in(const fs::path& folder) {
  size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) count += entry.is_regular_file();
  return count;
}

// Those that have got their names: a worker that is killed leaves what it was writing.
size_t finished_files_in(const fs::path& folder) {
  size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    count += entry.is_regular_file() && entry.path().filename().string().front() != '.';
  return count;
}

void age(const fs::path& file, std::chrono::hours by) {
  fs::last_write_time(file, fs::file_time_type::clock::now() - by);
}

TEST(DiskCache, WhatIsWrittenIsReadByAnotherProcessesCache) {
  const TempDir dir;
  const Bytes bytes = filled(1000, 7);
  const Digest id = sha256(bytes);
  const auto one = DiskCache::open(dir.path(), 1 << 20), two = DiskCache::open(dir.path(), 1 << 20);
  EXPECT_FALSE(one->read(id));
  one->write(id, bytes);
  const ChunkBytes read = two->read(id);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, bytes);
}

TEST(DiskCache, ADamagedFileIsNotReadAndGoes) {
  const TempDir dir;
  const auto cache = DiskCache::open(dir.path(), 1 << 20);
  for (const int damage : {0, 1}) {
    const Bytes bytes = filled(1000, 7 + damage);
    const Digest id = sha256(bytes);
    cache->write(id, bytes);
    if (damage == 0) {
      fs::resize_file(file_of(dir, id), 999);
    } else {
      std::fstream file(file_of(dir, id), std::ios::in | std::ios::out);
      file.seekp(500);
      file.put('x');
    }
    EXPECT_FALSE(cache->read(id));
    EXPECT_FALSE(fs::exists(file_of(dir, id)));
    cache->write(id, bytes);
    EXPECT_TRUE(cache->read(id));
  }
}

TEST(DiskCache, TheChunksUsedLongestAgoGo) {
  const TempDir dir;
  std::vector<Digest> ids;
  {
    const auto cache = DiskCache::open(dir.path(), 1 << 20);
    for (int i = 0; i < 10; ++i) {
      const Bytes bytes = filled(10000, i);
      ids.push_back(sha256(bytes));
      cache->write(ids.back(), bytes);
      age(file_of(dir, ids.back()), std::chrono::hours(20 - i));
    }
    EXPECT_TRUE(cache->read(ids[0]));  // used now
  }
  (void)DiskCache::open(dir.path(), 80000);  // 7/8 of it: room for seven
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(fs::exists(file_of(dir, ids[static_cast<size_t>(i)])), i == 0 || i >= 4) << i;
}

TEST(DiskCache, TheBoundHoldsWhileItIsWritten) {
  const TempDir dir;
  constexpr uint64_t kMax = 160000;
  const auto cache = DiskCache::open(dir.path(), kMax);
  for (int i = 0; i < 100; ++i) {
    const Bytes bytes = filled(5000, i);
    cache->write(sha256(bytes), bytes);
    EXPECT_LE(files_in(dir.path()) * 5000, kMax + kMax / 16 + 5000);
  }
  const Bytes large = filled(kMax + 1, 200);
  cache->write(sha256(large), large);
  EXPECT_FALSE(cache->read(sha256(large)));
}

TEST(DiskCache, AbandonedTemporaryFilesGoAndYoungOnesStay) {
  const TempDir dir;
  (void)DiskCache::open(dir.path(), 1 << 20);
  fs::create_directories(dir.path() / "chunks/ab");
  for (const char* name : {".old.1.0", ".young.2.0"})
    std::ofstream(dir.path() / "chunks/ab" / name) << "half";
  age(dir.path() / "chunks/ab/.old.1.0", std::chrono::hours(2));
  (void)DiskCache::open(dir.path(), 1 << 20);
  EXPECT_FALSE(fs::exists(dir.path() / "chunks/ab/.old.1.0"));
  EXPECT_TRUE(fs::exists(dir.path() / "chunks/ab/.young.2.0"));
}

TEST(DiskCache, ManyWritersOfTheSameChunksDoNotDisturbEachOther) {
  const TempDir dir;
  {
    std::vector<std::jthread> writers;
    for (int w = 0; w < 4; ++w)
      writers.emplace_back([&] {
        const auto cache = DiskCache::open(dir.path(), 400000);
        for (int i = 0; i < 60; ++i) {
          const Bytes bytes = filled(10000, i % 40);  // 400 kB at once, so that files also go
          const Digest id = sha256(bytes);
          cache->write(id, bytes);
          if (const ChunkBytes read = cache->read(id)) EXPECT_EQ(*read, bytes);
        }
      });
  }
  for (const auto& entry : fs::recursive_directory_iterator(dir.path() / "chunks"))
    if (entry.is_regular_file()) EXPECT_EQ(sha256(*read_file(entry.path())).hex(), entry.path().filename());
}

TEST(DiskCache, AFullDiskTurnsItOffAndNothingIsLeftHalf) {
  const TempDir dir;
  const auto cache = DiskCache::open(dir.path(), 1 << 20);
  const Bytes small = filled(1000, 1), large = filled(100000, 2), third = filled(1000, 3);
  cache->write(sha256(small), small);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto old = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{50000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &full);
  cache->write(sha256(large), large);
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, old);
  EXPECT_FALSE(cache->read(sha256(large)));
  cache->write(sha256(third), third);
  EXPECT_FALSE(cache->read(sha256(third))) << "it wrote on";
  EXPECT_TRUE(cache->read(sha256(small)));
  EXPECT_EQ(files_in(dir.path()), 1u);
}

TEST(DiskCache, AFolderThatCannotBeMadeIsNoCache) {
  const TempDir dir;
  std::ofstream(dir.path() / "file") << "not a folder";
  EXPECT_FALSE(DiskCache::open(dir.path() / "file" / "cache", 1 << 20));
}

TEST(DiskCache, AWorkerThatStartsAgainAsksForNothing) {
  const TempDir dir;
  RawListener listener;
  const TestJob job;
  size_t asked = 0;
  {
    WorkerProcess worker(listener.port(), {"--cache", dir.path().string()});
    auto peer = listener.accept();
    ASSERT_TRUE(peer && make_ready(*peer, job, &asked));
    EXPECT_EQ(asked, job.chunks.size());
    peer->send(unit_of(job, 1));  // by its result, the chunks are long on disk
    ASSERT_TRUE(peer->next<Result>());
    const SteadyClock clock;
    for (const int64_t limit = clock.now_ms() + 5000;
         finished_files_in(dir.path() / "chunks") < job.chunks.size() && clock.now_ms() < limit;)
      ASSERT_TRUE(peer->next<Heartbeat>());
    EXPECT_EQ(finished_files_in(dir.path() / "chunks"), job.chunks.size());
  }
  fs::resize_file(file_of(dir, job.spec.atlas), 3);
  asked = 0;
  WorkerProcess worker(listener.port(), {"--cache", dir.path().string()});
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job, &asked));
  EXPECT_EQ(asked, 1u) << "all but the damaged chunk were on disk";
}

}  // namespace
}  // namespace kiln

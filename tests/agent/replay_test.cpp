// A unit that failed, crashed or hung can be baked alone.
#include "worker/agent/replay.h"

#include <fstream>

#include "common/base/files.h"
#include "common/responses/quantities.h"
#include "tests/farm/stub_caches.h"
#include "tests/farm/worker_process.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

using namespace test;

// Gives unit 4 to a worker with a cache; returns when the worker has failed it or died.
void give_unit_4(const TempDir& cache, std::string& said, const Bytes& blob = {}) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port(), {"--cache", cache.path().string()});
  auto peer = listener.accept();
  ASSERT_TRUE(peer && make_ready(*peer, job));
  Unit unit = unit_of(job, 4);
  if (!blob.empty()) unit.unit.cache = sha256(blob);
  peer->send(unit);
  if (!blob.empty()) {
    ASSERT_TRUE(peer->next<ChunkRequest>());
    peer->send(ChunkPiece{unit.unit.cache, 0, blob.size(), blob, false});
  }
  const size_t chunks = job.chunks.size() + !blob.empty();
  (void)peer->next<UnitFailed>();
  const SteadyClock clock;
  size_t files = 0;  // chunks are written behind the bake
  for (const int64_t limit = clock.now_ms() + 5000; files < chunks && clock.now_ms() < limit;) {
    files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(cache.path() / "chunks"))
      files += entry.is_regular_file() && entry.path().filename().string()[0] != '.';
  }
  worker.says("--replay");
  said = worker.said;
}

std::string replay_file(const TempDir& cache) {
  return (cache.path() / "replay" / "000000000000004d-4.json").string();
}

CommandResult replay(const TempDir& cache) {
  return run_command((binary_dir() / "bin/kiln-stub-worker").string() + " --replay " + replay_file(cache));
}

std::string true_digest() {
  const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
  return result_digest(stub_bake(make_units(4, 1)[0], planes)).hex();
}

TEST(Replay, AFailedUnitFailsAgainAndTheFixedProgramBakesIt) {
  const TempDir cache;
  std::string said;
  const StubOptions stub("fail=4");
  give_unit_4(cache, said);
  EXPECT_NE(said.find("kiln-worker --replay " + replay_file(cache)), std::string::npos) << said;
  const auto again = replay(cache);
  EXPECT_EQ(again.exit_status, 1) << again.output;
  EXPECT_NE(again.output.find("not enough memory, says the stub"), std::string::npos) << again.output;
  const StubOptions fixed("");
  const auto good = replay(cache);
  EXPECT_EQ(good.exit_status, 0) << good.output;
  EXPECT_NE(good.output.find("digest " + true_digest()), std::string::npos) << good.output;
  EXPECT_NE(good.output.find("rays 128"), std::string::npos) << good.output;
}

TEST(Replay, TheIrradianceCacheOfAUnitIsReplayedToo) {
  const TempDir cache;
  const IrradianceCache irradiance = stub_cache(7);
  const Bytes blob = write_irradiance_cache(irradiance);
  std::string said;
  {
    const StubOptions stub("fail=4");
    give_unit_4(cache, said, blob);
  }
  const auto file = read_file(replay_file(cache));
  ASSERT_TRUE(file);
  const std::string content(reinterpret_cast<const char*>(file->data()), file->size());
  const std::string name = sha256(blob).hex();
  EXPECT_NE(content.find(name, content.find("\"chunks\"")), std::string::npos) << content;
  const auto good = replay(cache);
  EXPECT_EQ(good.exit_status, 0) << good.output;
  const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
  const UnitResult truth = stub_bake(make_units(4, 1)[0], planes, &irradiance);
  EXPECT_NE(good.output.find("digest " + result_digest(truth).hex()), std::string::npos) << good.output;
  EXPECT_NE(result_digest(truth).hex(), true_digest());
  fs::remove(cache.path() / "chunks" / name.substr(0, 2) / name);
  const auto lost = replay(cache);
  EXPECT_EQ(lost.exit_status, 1);
  EXPECT_NE(lost.output.find("chunk " + name + " is not in"), std::string::npos) << lost.output;
}

TEST(Replay, ACrashLeavesItsUnitBehind) {
  const TempDir cache;
  std::string said;
  {
    const StubOptions stub("crash=4;slow=300");  // the chunks are on disk by then
    give_unit_4(cache, said);
  }
  EXPECT_NE(said.find("--replay " + replay_file(cache)), std::string::npos) << said;
  const auto good = replay(cache);
  EXPECT_EQ(good.exit_status, 0) << good.output;
  EXPECT_NE(good.output.find("digest " + true_digest()), std::string::npos) << good.output;
}

TEST(Replay, WithoutItsChunksItSaysWhich) {
  const TempDir cache;
  std::string said;
  const StubOptions stub("fail=4");
  give_unit_4(cache, said);
  fs::remove_all(cache.path() / "chunks");
  const auto result = replay(cache);
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_NE(result.output.find("is not in " + cache.path().string()), std::string::npos) << result.output;
}

TEST(Replay, WhatIsWrittenIsReadAndNothingElse) {
  Replay replay{TestJob().spec, make_units(~uint64_t{0} - 3, 1, 64)[0]};
  replay.unit.replicate = 1;
  replay.unit.take = 3;
  replay.unit.cache = sha256({});
  const std::string content = write_replay(replay, {replay.job.scene, replay.job.atlas});
  const auto read = read_replay(content);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(write_job(read->job), write_job(replay.job));
  EXPECT_EQ(read->unit.id, replay.unit.id);
  EXPECT_EQ(read->unit.first_sample, 64u);
  EXPECT_EQ(read->unit.sample_count, replay.unit.sample_count);
  EXPECT_EQ(read->unit.sites, replay.unit.sites);
  EXPECT_EQ(read->unit.replicate, 1u);
  EXPECT_EQ(read->unit.take, 3u);
  EXPECT_EQ(read->unit.cache, replay.unit.cache);
  for (size_t cut = 0; cut + 2 < content.size(); cut += 7) EXPECT_FALSE(read_replay(content.substr(0, cut)));
  for (const auto& [from, to] :
       {std::pair("\"sites\": \"0,", "\"sites\": \"-1,"), std::pair("\"sites\": \"0,", "\"sites\": \",,"),
        std::pair("\"job\": \"", "\"job\": \"zz"), std::pair("\"unit\"", "\"units\""),
        std::pair("\"replicate\": 1", "\"replicate\": 2"), std::pair("\"cache\": \"", "\"cache\": \"zz")}) {
    std::string wrong = content;
    const size_t at = wrong.find(from);
    ASSERT_NE(at, std::string::npos) << from << content;
    wrong.replace(at, std::string(from).size(), to);
    EXPECT_FALSE(read_replay(wrong)) << to;
  }
}

}  // namespace
}  // namespace kiln

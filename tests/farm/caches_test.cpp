// Irradiance caches and replicates on whole farms, and what the coordinator serves of them.
#include <signal.h>
#include <unistd.h>

#include <thread>

#include "common/responses/quantities.h"
#include "tests/farm/farm_support.h"
#include "tests/farm/raw_peer.h"
#include "tests/farm/stub_caches.h"

namespace kiln {
namespace {

using namespace test;

constexpr uint32_t kUnits = 20;  // of a pass

// Passes as a conductor makes them: what each of a pass's caches holds follows from the results of the last.
class Passes {
 public:
  explicit Passes(FarmJob& job) : job_(job) {}

  // `on_result` is called with the number of results so far.
  Expected<PassEnd> run(uint32_t count, const std::function<void(size_t)>& on_result = {}) {
    moments.clear();
    std::vector<IrradianceCache> caches;
    for (uint32_t pass = 0; pass < count; ++pass) {
      KILN_TRY(const PassEnd end, run_pass(pass, caches, on_result));
      if (end != PassEnd::kComplete) return end;
      caches.clear();
      const double seen = moments[unit_id(pass, 0)].front();
      for (uint32_t r = 0; r < kReplicates; ++r)
        caches.push_back(stub_cache(static_cast<uint32_t>(seen * 1e6) + r));
    }
    return PassEnd::kComplete;
  }
  std::map<uint64_t, std::vector<double>> moments;  // by unit

 private:
  static uint64_t unit_id(uint32_t pass, uint32_t unit) { return 1000 * pass + 1 + unit; }

  Expected<PassEnd> run_pass(uint32_t pass, const std::vector<IrradianceCache>& caches,
                             const std::function<void(size_t)>& on_result) {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    std::vector<Digest> ids;
    for (const IrradianceCache& cache : caches) ids.push_back(job_.add_chunk(write_irradiance_cache(cache)));
    std::vector<WorkUnit> units = make_units(unit_id(pass, 0), kUnits, pass * 8);
    for (WorkUnit& unit : units) {
      unit.replicate = static_cast<uint32_t>(unit.id % kReplicates);
      if (!ids.empty()) unit.cache = ids[unit.replicate];
    }
    PassHandlers handlers;
    handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) -> Status {
      const IrradianceCache* cache = caches.empty() ? nullptr : &caches[unit.replicate];
      EXPECT_EQ(result.moments, stub_bake(unit, planes, cache).moments) << "unit " << unit.id;
      moments[unit.id] = result.moments;
      if (on_result) on_result(moments.size());
      return {};
    };
    return job_.run_pass(std::move(units), 0, handlers);
  }
  FarmJob& job_;
};

void expect_complete(const Expected<PassEnd>& end) {
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(*end, PassEnd::kComplete);
}

TEST(FarmCaches, EveryUnitIsBakedWithItsOwnWhoeverDies) {
  const TempDir dir;
  const StubOptions stub("slow=10;dir=" + dir.path().string());
  const TestJob job;
  auto farm = start_farm(stub_settings(3), job);
  ASSERT_TRUE(farm) << farm.error().message;
  Passes passes(*farm->job);
  expect_complete(passes.run(4, [&](size_t done) {
    if (done % 17 == 5) ::kill(busy_workers(dir.path()).front(), SIGKILL);
  }));
  EXPECT_EQ(passes.moments.size(), 4 * kUnits);
  EXPECT_GE(farm->job->statistics().workers_lost, 3u);
}

TEST(FarmCaches, ASecondWorkerIsGivenTheSame) {
  const TestJob job;
  auto farm = start_farm(stub_settings(2), job, quorum_of_two());
  ASSERT_TRUE(farm) << farm.error().message;
  expect_complete(Passes(*farm->job).run(3));
  const FarmStatistics statistics = farm->job->statistics();
  EXPECT_GE(statistics.duplicates, 3 * kUnits);
  EXPECT_EQ(statistics.verification.verified, 3 * kUnits);
}

TEST(FarmCaches, AUnitOfACacheThatNobodyAddedIsAnError) {
  const TestJob job;
  auto farm = start_farm(stub_settings(1), job);
  ASSERT_TRUE(farm) << farm.error().message;
  std::vector<WorkUnit> units = make_units(1, 1);
  units[0].cache = sha256({});
  const auto end = farm->job->run_pass(units, 0, {});
  ASSERT_FALSE(end);
  EXPECT_NE(end.error().message.find(units[0].cache.hex()), std::string::npos) << end.error().message;
}

TEST(FarmCaches, ACacheOfAnotherSizeFailsTheJobByName) {
  const TestJob job;
  auto farm = start_farm(stub_settings(2), job);
  ASSERT_TRUE(farm) << farm.error().message;
  std::vector<WorkUnit> units = make_units(1, 4);
  units[2].cache = farm->job->add_chunk(write_irradiance_cache(stub_cache(1, 3)));
  const auto end = farm->job->run_pass(units, 0, {});
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(end.error().message.find("unit 3"), std::string::npos) << end.error().message;
  EXPECT_NE(end.error().message.find(units[2].cache.hex()), std::string::npos) << end.error().message;
}

// A worker played by the test on a farm that has no other.
struct PeerFarm {
  PeerFarm() {
    FarmSettings settings;
    settings.local_workers = 0;
    settings.token = "token";
    settings.others_may_come = true;
    auto started = start_farm(settings, job);
    EXPECT_TRUE(started);
    farm = std::move(*started);
  }
  RawPeer worker() const {
    RawPeer peer = RawPeer::connect(farm.farm->port());
    peer.send(Hello{"0.0.9", "token", "host", 1, 102, 1, "avx2", "none"});
    EXPECT_TRUE(peer.next<Job>());
    peer.send(JobClass{job.spec.id, "class"});
    peer.send(Credits{job.spec.id, 4});
    return peer;
  }
  static Result answer(const Unit& unit) {
    const auto planes = static_cast<uint32_t>(MomentLayout(TransportSettings{}.basis).planes());
    Result r{unit.job, unit.lease, stub_bake(unit.unit, planes), {}};
    r.digest = result_digest(r.result);
    return r;
  }
  const TestJob job;
  TestFarm farm;
};

TEST(FarmCaches, TheOnesOfTheLastPassAreGone) {
  PeerFarm place;
  std::vector<WorkUnit> units[] = {make_units(1, 1), make_units(2, 1)};
  units[0][0].cache = place.farm.job->add_chunk(write_irradiance_cache(stub_cache(1)));
  units[1][0].cache = place.farm.job->add_chunk(write_irradiance_cache(stub_cache(2)));
  EXPECT_NE(units[0][0].cache, units[1][0].cache);
  std::vector<std::string> problems;
  std::thread conductor([&] {
    for (size_t pass = 0; pass < 2; ++pass) {
      if (pass == 1) place.farm.job->add_chunk(write_irradiance_cache(stub_cache(2)));
      const auto end = place.farm.job->run_pass(units[pass], 0, {});
      if (!end) problems.push_back(end.error().message);
    }
  });
  RawPeer peer = place.worker();
  const auto asked = [&](const Digest& id) {
    peer.send(ChunkRequest{{id}, false});
    return peer.next<ChunkPiece>(300).has_value();
  };
  for (size_t pass = 0; pass < 2; ++pass) {
    const auto unit = peer.next<Unit>();
    ASSERT_TRUE(unit);
    EXPECT_EQ(unit->unit.cache, units[pass][0].cache);
    EXPECT_EQ(asked(units[0][0].cache), pass == 0);
    EXPECT_EQ(asked(units[1][0].cache), pass == 1);
    peer.send(PeerFarm::answer(*unit));
  }
  conductor.join();
  EXPECT_TRUE(problems.empty()) << problems.front();
}

TEST(FarmCaches, AnAnswerToWhatANumberStoodForBeforeIsDroppedAndTheUnitIsGivenAnew) {
  PeerFarm place;
  std::vector<WorkUnit> units = make_units(1, 1);
  size_t merged = 0;
  PassHandlers handlers;
  handlers.on_result = [&](const WorkUnit&, const UnitResult&) -> Status {
    ++merged;
    return {};
  };
  Expected<PassEnd> end = PassEnd::kTimeUp;
  std::thread conductor([&] { end = place.farm.job->run_pass(units, 0, handlers); });
  RawPeer peer = place.worker();
  const auto unit = peer.next<Unit>();
  ASSERT_TRUE(unit);
  Unit before = *unit;
  before.unit.sites.pop_back();
  Result stale = PeerFarm::answer(before);
  stale.shape = unit_shape(before.unit);
  peer.send(stale);
  const auto forget = peer.next<CommitAck>();
  ASSERT_TRUE(forget);
  EXPECT_EQ(forget->digest, stale.digest);
  const auto again = peer.next<Unit>();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->unit.sites, unit->unit.sites);
  Result good = PeerFarm::answer(*again);
  good.shape = unit_shape(again->unit);
  peer.send(good);
  conductor.join();
  expect_complete(end);
  EXPECT_EQ(merged, 1u);
}

// Its results of an earlier run cannot be read.
class DamagedStore final : public ResultStore {
 public:
  bool durable() const override { return true; }
  void put(const StoreAnswer&, std::shared_ptr<const UnitResult>, std::function<void()> stored) override {
    stored();
  }
  void settle(const Settle&) override {}
  void revoke(const Revoke&) override { ++revoked; }
  void pin_class(JobId, const std::string&) override {}
  void trust(const Trust&) override {}
  void quarantine(const Quarantine&) override {}
  void note(JobId, const std::string&) override {}
  void end_job(JobId) override {}
  Expected<std::shared_ptr<const UnitResult>> read(JobId, uint64_t, const Digest&) override {
    return fail(ErrorKind::kIo, "the disk is damaged");
  }
  std::atomic<size_t> revoked = 0;
};

TEST(FarmCaches, ARewoundJobAddsThemAgain) {
  const StubOptions stub("slow=5");
  const TestJob job;
  const auto store = std::make_shared<DamagedStore>();
  TestFarm farm;
  farm.farm = std::move(*Farm::start(stub_settings(3), store));
  std::vector<WorkUnit> first = make_units(1, kUnits);
  first[4].replicate = 1;
  const KnownAnswer known{5, unit_shape(first[4]), sha256({}), "somebody", true, false};
  farm.job = std::move(*farm.farm->open_job({job.spec, &job.chunks, {}, {known}}));
  Passes passes(*farm.job);
  size_t rewinds = 0;
  Expected<PassEnd> end = PassEnd::kRewound;
  while (end && *end == PassEnd::kRewound) {
    end = passes.run(3);
    rewinds += end && *end == PassEnd::kRewound;
  }
  expect_complete(end);
  EXPECT_EQ(passes.moments.size(), 3 * kUnits);
  EXPECT_EQ(rewinds, 1u);
  EXPECT_EQ(store->revoked, 1u);
}

// Every unit of the pass is stored, so that the pass is complete before the first result is read.
TEST(FarmCaches, APassIsNotCompleteWhenItsStoredResultsCannotBeRead) {
  const TestJob job;
  const auto store = std::make_shared<DamagedStore>();
  TestFarm farm;
  farm.farm = std::move(*Farm::start(stub_settings(1), store));
  const std::vector<WorkUnit> units = make_units(1, 3);
  std::vector<KnownAnswer> known;
  for (const WorkUnit& unit : units)
    known.push_back({unit.id, unit_shape(unit), sha256({}), "it", true, true});
  farm.job = std::move(*farm.farm->open_job({job.spec, &job.chunks, {}, known}));
  std::set<uint64_t> merged;
  PassHandlers handlers;
  handlers.on_result = [&](const WorkUnit& unit, const UnitResult&) -> Status {
    merged.insert(unit.id);
    return {};
  };
  Expected<PassEnd> end = PassEnd::kRewound;
  for (int i = 0; i < 10 && end && *end == PassEnd::kRewound; ++i) {
    merged.clear();
    end = farm.job->run_pass(units, 0, handlers);
  }
  expect_complete(end);
  EXPECT_EQ(merged.size(), units.size());
}

TEST(FarmCaches, AStoredResultOfAnotherReplicateOrCacheIsAnotherUnits) {
  WorkUnit unit = make_units(1, 1)[0];
  const uint64_t shape = unit_shape(unit);
  unit.replicate = 1;
  const uint64_t other = unit_shape(unit);
  unit.cache = sha256({});
  EXPECT_NE(shape, other);
  EXPECT_NE(shape, unit_shape(unit));
  EXPECT_NE(other, unit_shape(unit));
}

}  // namespace
}  // namespace kiln

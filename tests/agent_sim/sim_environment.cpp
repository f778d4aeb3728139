#include "tests/agent_sim/sim_environment.h"

#include "common/base/format.h"
#include "common/responses/quantities.h"
#include "tests/farm/stub_bake.h"

namespace kiln::sim {
namespace {

class SimBaker final : public Baker {
 public:
  explicit SimBaker(const TransportSettings& settings)
      : planes_(static_cast<uint32_t>(MomentLayout(settings.basis, settings.quantities).planes())) {}
  Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache) const override {
    return test::stub_bake(unit, planes_, cache);
  }
  size_t sites() const override { return test::kStubSites; }
  std::vector<std::string> warnings() const override { return {}; }

 private:
  const uint32_t planes_;
};

}  // namespace

std::unique_ptr<Baker> sim_baker(const TransportSettings& settings) {
  return std::make_unique<SimBaker>(settings);
}

SimEnvironment::SimEnvironment(Clockwork& clock, const AgentSettings& settings, const MachineTraits& traits,
                               uint32_t process, SimHost host)
    : timing_(clock), settings_(settings), traits_(traits), process_(process), host_(std::move(host)) {
  if (!traits_.cache.empty()) disk_ = DiskCache::open(traits_.cache, uint64_t{1} << 30);
}

Hello SimEnvironment::hello() {
  return {"sim", "token", traits_.name, process_, 0, traits_.threads, "avx2", "sim"};
}

void SimEnvironment::classify(const std::string& isa, std::function<void(Expected<std::string>)> done) {
  timing_.later(some(100), [isa, done] { done(isa + "-sim"); });
}

void SimEnvironment::prepare(const JobSpec& job, JobChunks chunks, Prepared done) {
  auto baker = make_ready_baker(job, chunks, settings_);
  timing_.later(some(300), [done, baker = std::move(baker)] { done(baker); });
}

void SimEnvironment::bake(BakeTask task, std::function<void(const Unit&, Expected<UnitResult>)> done) {
  on_baked_ = std::move(done);
  queue_.push_back(std::move(task));
  begin();
}

// A unit that hangs keeps its thread.
void SimEnvironment::begin() {
  while (begun_.size() < traits_.threads && !queue_.empty()) {
    BakeTask task = std::move(queue_.front());
    queue_.pop_front();
    const auto begun = begun_.insert(begun_.end(), {task.unit.job, task.unit.unit.id, timing_.now_ms()});
    const SimHost::Fate fate = host_.fate(task.unit);
    if (fate == SimHost::Fate::kHangs) continue;
    timing_.later(traits_.unit_ms / 2 + some(traits_.unit_ms), [this, begun, fate, task = std::move(task)] {
      begun_.erase(begun);
      Expected<UnitResult> result = fail(ErrorKind::kNoSpace, "the simulated machine has no memory");
      if (fate == SimHost::Fate::kBakes) {
        Expected<const IrradianceCache*> cache = nullptr;
        if (task.cache) cache = task.cache->get();
        if (cache)
          result = task.baker->bake(task.unit.unit, *cache);
        else
          result = fail(cache.error().kind, cache.error().message);
      }
      begin();
      on_baked_(task.unit, std::move(result));
    });
  }
}

std::vector<Unit> SimEnvironment::take_unbegun(const std::function<bool(const Unit&)>& wanted) {
  std::vector<Unit> units;
  std::erase_if(queue_, [&](BakeTask& task) {
    if (!wanted(task.unit)) return false;
    units.push_back(task.unit);
    return true;
  });
  return units;
}

std::optional<BakePool::Begun> SimEnvironment::oldest() const {
  if (begun_.empty()) return std::nullopt;
  return begun_.front();
}

void SimEnvironment::look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) {
  timing_.later(some(30), [this, ids = std::move(ids), done] {
    std::vector<ChunkBytes> found;
    for (const Digest& id : ids) found.push_back(disk_->read(id));
    done(found);
  });
}

void SimEnvironment::store(const Digest& id, ChunkBytes bytes) {
  if (disk_) timing_.later(some(30), [this, id, bytes = std::move(bytes)] { disk_->write(id, *bytes); });
}

std::string SimEnvironment::replay_file(uint64_t job, uint64_t unit) const {
  return disk_->replay_file(job, unit).string();
}

}  // namespace kiln::sim

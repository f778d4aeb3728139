// The coordinator: the real server and store, and a conductor for each job.
#include "tests/agent_sim/world.h"

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/responses/quantities.h"
#include "tests/farm/stub_caches.h"

namespace kiln::sim {
namespace fs = std::filesystem;

World::World(uint64_t seed, fs::path folder)
    : seed_(seed), folder_(std::move(folder)), clock_(seed), disk_(seed) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  settings_.token = "token";
  settings_.others_may_come = settings_.comes_back = true;
  settings_.rules.lease_ms = 2000;
  settings_.rules.hang_ms = 60000;
  settings_.rules.residence_ms = 200;
  // Machines die of what the world does to them, not of their units.
  settings_.rules.max_attempts = 12;
  rotting_ = clock_.chance(0.3);
  lying_ = clock_.chance(0.15);
  disk_.lie(lying_);
  faults_end_ = 2000 + static_cast<int64_t>(clock_.draw(8000));
  make_jobs();
  make_machines();
}

World::~World() {
  for (size_t i = 0; i < machines_.size(); ++i) machines_[i].agent.reset();
  server_.reset();
  results_.reset();
  store_.reset();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void World::fail(const std::string& sentence) {
  if (failure_.empty()) failure_ = text("at {} ms: {}", clock_.now(), sentence);
}

void World::make_jobs() {
  for (JobId id = 1; id <= 1 + clock_.draw(2); ++id) {
    SimJob& job = jobs_[id];
    Scene scene;
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
    mesh.normals.assign(3, Vec3(0, 0, 1));
    mesh.triangles = {{0, 1, 2}};
    mesh.source_triangle = {0};
    mesh.name = text("mesh {}", id);
    scene.meshes.push_back(mesh);
    scene.materials.push_back({"metallic_roughness", "white", Mat4x3(1.0f), {}});
    scene.instances.push_back({0, 0, Mat4x3(1.0f), "node", 0, 0, 0});
    Atlas atlas;
    atlas.width = atlas.height = 4;
    atlas.charts.push_back({{{0, 0}, {1, 0}, {1, 1}}, {0}, {}, 1, false});
    atlas.charts_of_instance = {0};
    atlas.instance_first_chart = {0, 1};
    atlas.placements.push_back({Vec2(4.0f), Vec2(0.0f), 0});
    atlas.sites.first_word = {0};
    job.spec.id = id;
    job.spec.scene = write_scene(scene, job.chunks);
    job.spec.atlas = job.chunks.add(write_atlas(atlas));
    job.quorum = clock_.chance(0.3) ? 2 : 1;
    job.poisoned = clock_.chance(0.06);
    uint64_t unit = 1;
    for (uint64_t pass = 0; pass <= clock_.draw(3); ++pass) {
      std::shared_ptr<const Bytes> cache;
      if (pass > 0)
        cache = std::make_shared<const Bytes>(
            write_irradiance_cache(test::stub_cache(static_cast<uint32_t>(10 * id + pass))));
      job.caches.push_back(cache);
      std::vector<WorkUnit>& units = job.passes.emplace_back();
      const uint64_t last = unit + 4 + clock_.draw(16);
      for (; unit < last; ++unit) {
        WorkUnit u{unit, static_cast<uint32_t>(pass * 8), 4, {}, static_cast<uint32_t>(unit % kReplicates)};
        for (uint64_t s = 0; s <= clock_.draw(3); ++s) u.sites.push_back(static_cast<uint32_t>(unit * 4 + s));
        if (cache) u.cache = sha256(*cache);
        units.push_back(u);
      }
    }
  }
}

Digest World::truth(const SimJob& job, const WorkUnit& unit) const {
  const auto planes =
      static_cast<uint32_t>(MomentLayout(job.spec.transport.basis, job.spec.transport.quantities).planes());
  const Bytes* bytes = nullptr;
  for (const auto& cache : job.caches)
    if (cache && unit.cache == sha256(*cache)) bytes = cache.get();
  if (!bytes) return result_digest(test::stub_bake(unit, planes));
  const auto cache = read_irradiance_cache(*bytes, test::kStubSites);
  return result_digest(test::stub_bake(unit, planes, &*cache));
}

void World::start_coordinator() {
  StoreOptions options;
  options.faults = &disk_;
  options.spool_file_bytes = 8 << 10;
  auto opened = Store::open(folder_ / "data", options);
  if (!opened) return fail(text("the store does not open: {}", opened.error().message));
  store_ = std::move(*opened);
  // Now, not when its writer happens to be idle: a seed decides everything.
  if (const Status checked = store_->compact(); !checked)
    return fail(text("the store is damaged: {}", checked.error().message));
  coordinator_ = std::make_unique<ProcessTiming>(clock_);
  results_ = std::make_unique<SimStore>(*store_, *coordinator_,
                                        [this](bool on) { server_->hold(on, "the disk refuses"); });
  server_ = std::make_unique<Server>(*coordinator_, settings_, *results_);
  check_stored();
  for (auto& [id, job] : jobs_) {
    if (!job.ended.empty()) continue;
    if (!store_->job(id)) {
      JobRecord record;
      record.name = text("job {}", id);
      record.user = "sim";
      record.inputs = {{"room.gltf", sha256({}), 0}};
      record.scene = "room.gltf";
      record.submission = text("sim {}", id);
      const auto submitted = store_->submit(record);
      if (!submitted || *submitted != id) return fail("a job cannot be submitted");
    }
    JobTraits traits;
    traits.user = "sim";
    traits.quorum = job.quorum;
    traits.numeric_class = store_->job(id)->numeric_class;
    std::vector<KnownAnswer> known;
    const auto rows = store_->commits(id);
    if (!rows) return fail(text("results cannot be listed: {}", rows.error().message));
    for (const CommitRow& row : *rows)
      known.push_back({row.unit, row.shape, row.digest, row.worker, row.settled, row.verified});
    job.port = std::make_shared<JobPort>(true);
    if (const Status s = server_->open_job({job.spec, &job.chunks, traits, known}, job.port); !s)
      return fail(s.error().message);
    job.pass = 0;
    begin_pass(job);
  }
  tick();
}

// An answer that was acknowledged survives whatever happened, unless the disk itself spoilt or forgot it.
void World::check_stored() {
  for (const auto& [id, unit, digest] : acknowledged_) {
    if (!store_->job(id) || !jobs_.at(id).ended.empty() || damaged_.count({id, unit}) || lying_) continue;
    const auto stored = store_->read_result(id, unit, digest);
    if (!stored && !rotting_)
      fail(text("unit {} of job {} was acknowledged and is not on disk: {}", unit, id,
                stored.error().message));
  }
}

// By SIGKILL, and sometimes by a power cut in the middle of a write.
void World::kill_coordinator() {
  if (!coordinator_) return;
  ++figures_.restarts;
  if (clock_.chance(0.5)) {
    disk_.set_mood(DiskMood::kDying);
    results_->begin_and_die();
  }
  figures_.refused_writes += results_->refused();
  server_.reset();
  results_.reset();
  store_.reset();
  coordinator_.reset();
  figures_.lost_blocks += disk_.power_cut();
  clock_.at(clock_.now() + 100 + static_cast<int64_t>(clock_.draw(2000)), [this] { start_coordinator(); });
}

void World::tick() {
  server_->tick();
  for (auto& [id, job] : jobs_) conduct(job);
  coordinator_->later(20, [this] { tick(); });
}

void World::begin_pass(SimJob& job) {
  if (job.pass == 0) job.merged.clear();
  std::set<Digest> named;
  if (const auto& cache = job.caches[job.pass]) {
    named.insert(sha256(*cache));
    server_->add_chunk(job.spec.id, sha256(*cache), cache);
  }
  server_->keep_chunks(job.spec.id, named);
  job.units = std::make_shared<const PassUnits>(job.passes[job.pass]);
  if (job.port->clear()) {  // rewound since the pass ended
    job.pass = 0;
    return begin_pass(job);
  }
  server_->begin_pass(job.spec.id, job.units);
}

void World::conduct(SimJob& job) {
  if (!job.ended.empty() || !failure_.empty()) return;
  if (const auto error = job.port->error()) return end_job(job, error->message);
  while (auto event = job.port->pop(0)) {
    if (const auto* delivered = std::get_if<DeliveredUnit>(&*event)) {
      deliver(job, *delivered);
    } else if (const auto* skipped = std::get_if<SkippedUnit>(&*event)) {
      return fail(text("unit {} was skipped: {}", skipped->unit, skipped->reason));
    } else if (std::get<PassEnded>(*event).end == PassEnd::kRewound) {
      ++figures_.rewinds;
      job.pass = 0;
      return begin_pass(job);
    } else {
      for (const WorkUnit& unit : job.passes[job.pass])
        if (!job.merged.count(unit.id) && !damaged_.count({job.spec.id, unit.id}))
          return fail(text("pass {} of job {} is complete without unit {}", job.pass, job.spec.id, unit.id));
      if (job.port->clear()) {  // a stored result could not be read
        job.pass = 0;
      } else if (++job.pass == job.passes.size()) {
        return end_job(job, "done");
      }
      return begin_pass(job);
    }
  }
}

void World::deliver(SimJob& job, const DeliveredUnit& delivered) {
  const WorkUnit* unit = job.units->find(delivered.unit);
  if (!unit) return fail(text("unit {} of no pass is delivered", delivered.unit));
  std::shared_ptr<const UnitResult> result = delivered.result;
  if (!result) {
    const auto stored = results_->read(job.spec.id, delivered.unit, delivered.digest);
    if (!stored || result_digest(**stored) != delivered.digest) {
      if (!rotting_ && !lying_) fail(text("the stored result of unit {} is damaged", delivered.unit));
      damaged_.insert({job.spec.id, delivered.unit});
      return server_->damaged(job.spec.id, delivered.unit, "it cannot be read");
    }
    result = *stored;
  }
  damaged_.erase({job.spec.id, delivered.unit});
  const Digest digest = result_digest(*result);
  if (digest != truth(job, *unit)) fail(text("a wrong result of unit {} is merged", unit->id));
  if (!job.merged.emplace(unit->id, digest).second) fail(text("unit {} is merged twice", unit->id));
}

void World::end_job(SimJob& job, const std::string& how) {
  job.ended = how.empty() ? "?" : how;
  if (how == "done") {
    for (const auto& pass : job.passes)
      for (const WorkUnit& unit : pass)
        if (!job.merged.count(unit.id)) fail(text("a job is done without unit {}", unit.id));
  } else if (++figures_.failed_jobs; !job.poisoned) {
    fail(text("a sound job failed: {}", how));
  } else if (how.find("unit 1 ") == std::string::npos) {
    fail(text("a job failed and does not name its unit: {}", how));
  }
  server_->close_job(job.spec.id);
}

std::string World::run() {
  start_coordinator();
  for (size_t i = 0; i < machines_.size(); ++i)
    clock_.at(static_cast<int64_t>(clock_.draw(500)), [this, i] { start_agent(i); });
  clock_.at(0, [this] { make_trouble(); });
  const int64_t limit = faults_end_ + 600000;
  const auto all_ended = [&] {
    return std::all_of(jobs_.begin(), jobs_.end(),
                       [](const auto& entry) { return !entry.second.ended.empty(); });
  };
  while (failure_.empty() && clock_.now() < limit && !all_ended() && clock_.step()) continue;
  if (failure_.empty() && !all_ended()) {
    std::string why = "a job does not end:";
    for (auto& [id, job] : jobs_)
      if (job.ended.empty() && server_)
        for (const std::string& line : server_->ledger().why_job(id, clock_.now())) why += "\n    " + line;
    for (auto& [id, job] : jobs_)
      for (const WorkUnit& unit : job.passes[std::min(job.pass, job.passes.size() - 1)])
        if (job.ended.empty() && server_ && !job.merged.count(unit.id))
          for (const std::string& line : server_->ledger().why_unit(id, unit.id, clock_.now()))
            why += text("\n    unit {}: {}", unit.id, line);
    fail(why);
  }
  // What agents hold of ended jobs they let go of.
  const int64_t rest = std::max(clock_.now(), faults_end_) + 20000;
  while (failure_.empty() && clock_.now() < rest && clock_.step()) continue;
  for (const Machine& m : machines_)
    if (m.agent && coordinator_ && m.traffic.link && !m.agent->idle() && m.hung == 0)
      fail(text("{} still holds units after all jobs ended", m.traits.name));
  figures_.events = clock_.done();
  figures_.simulated_ms = clock_.now();
  return failure_;
}

WorldFigures& WorldFigures::operator+=(const WorldFigures& o) {
  for (const auto field :
       {&WorldFigures::events, &WorldFigures::kills, &WorldFigures::restarts, &WorldFigures::cuts,
        &WorldFigures::stalls, &WorldFigures::results, &WorldFigures::resent, &WorldFigures::twice,
        &WorldFigures::lost_blocks, &WorldFigures::rotten, &WorldFigures::refused_writes,
        &WorldFigures::rewinds, &WorldFigures::hung, &WorldFigures::drained, &WorldFigures::failed_jobs})
    this->*field += o.*field;
  simulated_ms += o.simulated_ms;
  return *this;
}

std::string WorldFigures::words() const {
  return text(
      "{:.1f} h simulated, {} events, {} results, {} sent again, {} arrived twice, {} workers killed, {} "
      "drained, {} units hung, {} links cut, {} stalls, {} coordinators killed, {} blocks lost, {} bits "
      "rotten, "
      "{} writes refused, {} rewinds, {} jobs failed by name",
      static_cast<double>(simulated_ms) / 3.6e6, events, results, resent, twice, kills, drained, hung, cuts,
      stalls, restarts, lost_blocks, rotten, refused_writes, rewinds, failed_jobs);
}

}  // namespace kiln::sim

#include "tests/farm/farm_support.h"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/atlas/atlas.h"
#include "tests/support/paths.h"

namespace kiln::test {

TestJob::TestJob(uint64_t id, uint32_t variant) {
  Scene s;
  Mesh m;
  m.name = "quad";
  m.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  m.normals.assign(4, Vec3(0, 0, 1));
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  m.source_triangle = {0, 1};
  s.meshes.push_back(m);
  s.materials.push_back({"metallic_roughness", "white", Mat4x3(1.0f), {}});
  Texture t;  // large enough for several pieces
  t.name = "noise";
  t.width = 3000, t.height = 1500, t.channels = 1;
  for (uint32_t i = 0; i < t.width * t.height; ++i)
    t.texels.push_back(std::byte((i + variant) * 2654435761u >> 13 & 255));
  s.textures.push_back(t);
  s.instances.push_back({0, 0, Mat4x3(1.0f), "node", 0, 0, 0});
  Atlas a;
  a.width = a.height = 4;
  a.charts.push_back({{{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}, {0, 0}, {}, 1, false});
  a.charts_of_instance = {0};
  a.instance_first_chart = {0, 1};
  a.placements.push_back({Vec2(4.0f), Vec2(0.0f), 0});
  a.sites.first_word = {0};
  spec.id = id;
  spec.scene = write_scene(s, chunks);
  spec.atlas = chunks.add(write_atlas(a));
}

std::vector<WorkUnit> make_units(uint64_t first_id, size_t count, uint32_t first_sample) {
  std::vector<WorkUnit> units;
  for (size_t i = 0; i < count; ++i) {
    WorkUnit u{first_id + i, first_sample, 8, {}};
    for (uint32_t s = 0; s < 16; ++s) u.sites.push_back(static_cast<uint32_t>(i * 16 + s));
    units.push_back(u);
  }
  return units;
}

StubOptions::StubOptions(const std::string& text) {
  ::setenv("KILN_STUB", text.c_str(), 1);
}
StubOptions::~StubOptions() {
  ::unsetenv("KILN_STUB");
}

FarmSettings stub_settings(uint32_t workers, uint32_t threads) {
  FarmSettings s;
  s.local_workers = workers;
  s.local_threads = threads;
  s.worker_program = (binary_dir() / "bin/kiln-stub-worker").string();
  s.rules.lease_ms = 5000;
  return s;
}

std::string PassOutcome::events() const {
  std::string all;
  for (const std::string& e : statistics.events) all += e + "\n";
  return all;
}

Expected<TestFarm> start_farm(const FarmSettings& settings, const TestJob& job, const JobTraits& traits) {
  TestFarm test;
  KILN_TRY(test.farm, Farm::start(settings));
  KILN_TRY(test.job, test.farm->open_job({job.spec, &job.chunks, traits, {}}));
  return test;
}

JobTraits quorum_of_two() {
  JobTraits traits;
  traits.quorum = 2;
  return traits;
}

PassOutcome bake(const FarmSettings& settings, std::vector<WorkUnit> units,
                 const std::function<void(size_t)>& on_result, int64_t deadline_ms, const JobTraits& traits) {
  const TestJob job;
  PassOutcome outcome;
  auto farm = start_farm(settings, job, traits);
  if (!farm) {
    outcome.complete = tl::unexpected<Error>(farm.error());
    return outcome;
  }
  const auto keep = [&](const WorkUnit& unit, const UnitResult& result) -> Status {
    if (!outcome.moments.emplace(unit.id, result.moments).second)
      return fail(ErrorKind::kInternal, "a unit was committed twice");
    if (on_result) on_result(outcome.moments.size());
    return {};
  };
  Expected<PassEnd> end = PassEnd::kRewound;
  while (end && *end == PassEnd::kRewound) {
    outcome.moments.clear();
    end = farm->job->run_pass(units, deadline_ms, {keep, {}, {}});
  }
  if (end)
    outcome.complete = *end == PassEnd::kComplete;
  else
    outcome.complete = tl::unexpected<Error>(end.error());
  outcome.statistics = farm->job->statistics();
  return outcome;
}

std::vector<pid_t> children_of(pid_t process) {
  std::vector<pid_t> children;  // of any thread: workers are those of the farm's
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task", gone)) {
    std::ifstream in(task.path() / "children");
    for (pid_t child; in >> child;) children.push_back(child);
  }
  std::sort(children.begin(), children.end());
  return children;
}

std::vector<pid_t> busy_workers(const std::filesystem::path& dir) {
  std::set<pid_t> found;
  for (const auto& mark : std::filesystem::directory_iterator(dir)) {
    const std::string name = mark.path().filename().string();  // unit-ID-PROCESS
    if (name.rfind("unit-", 0) == 0) found.insert(std::stoi(name.substr(name.rfind('-') + 1)));
  }
  std::erase_if(found, [](pid_t process) { return !alive(process); });
  return {found.begin(), found.end()};
}

bool alive(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/stat");
  std::string line;
  if (!std::getline(in, line)) return false;
  const char state = line[line.rfind(')') + 2];
  return state != 'Z' && state != 'X';
}

}  // namespace kiln::test

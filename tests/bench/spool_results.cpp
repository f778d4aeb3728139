#include "tests/bench/spool_results.h"

#include "common/base/check.h"

namespace kiln::bench {

DiskResults open_disk_results(const std::filesystem::path& folder) {
  DiskResults disk;
  auto store = Store::open(folder, {});
  KILN_CHECK(store);
  disk.store = std::move(*store);
  if (!disk.store->job(1)) {
    JobRecord record;
    record.name = "load";
    record.user = "ada";
    record.settings = "{}";
    record.inputs = {{"a.gltf", {}, 1}};
    record.scene = "a.gltf";
    const auto id = disk.store->submit(record);
    KILN_CHECK(id && *id == 1);
  }
  disk.results = std::make_shared<DurableResultStore>(
      *disk.store, DurableResultStore::Hooks{[](const std::string& reason) { KILN_CHECK(reason.empty()); },
                                             [](JobId, const std::string&) {}});
  return disk;
}

std::vector<KnownAnswer> DiskResults::known(JobId job) const {
  auto rows = store->commits(job);
  KILN_CHECK(rows);
  std::vector<KnownAnswer> known;
  known.reserve(rows->size());
  for (const CommitRow& row : *rows)
    known.push_back({row.unit, row.shape, row.digest, row.worker, row.settled, row.verified});
  return known;
}

void fill_store(const std::filesystem::path& folder, JobId job, const std::vector<WorkUnit>& units,
                uint32_t planes) {
  const DiskResults disk = open_disk_results(folder);
  for (const WorkUnit& unit : units) {
    auto result = std::make_shared<UnitResult>();
    result->unit = unit.id;
    result->site_count = static_cast<uint32_t>(unit.sites.size());
    result->plane_count = planes;
    result->moments.assign(unit.sites.size() * planes, 0.0);
    const Digest digest = result_digest(*result);
    disk.results->put({0, "peer", job, unit.id, unit_shape(unit), digest, 0}, result, [] {});
    disk.results->settle({job, unit.id, digest, false, "peer"});
  }
  KILN_CHECK(disk.results->drain(std::chrono::minutes(5)));
  KILN_CHECK(disk.store->flush());
}

}  // namespace kiln::bench

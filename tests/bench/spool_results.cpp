#include "tests/bench/spool_results.h"

#include "common/base/check.h"
#include "coordinator/dispatch/farm.h"

namespace kiln::bench {
namespace {

std::shared_ptr<const Bytes> bytes_of_result(const UnitResult& r) {
  ByteWriter w;
  w.put(r.unit);
  w.put(r.site_count);
  w.put(r.plane_count);
  w.put_array(r.moments);
  w.put(r.rays);
  return std::make_shared<const Bytes>(w.take());
}

void ignore(const Status& done) {
  KILN_CHECK(done);
}

}  // namespace

std::shared_ptr<SpoolResults> SpoolResults::open(const std::filesystem::path& folder) {
  auto made = std::make_shared<SpoolResults>();
  auto store = Store::open(folder, {});
  KILN_CHECK(store);
  made->store_ = std::move(*store);
  if (!made->store_->job(1)) {
    JobRecord record;
    record.name = "load";
    record.user = "ada";
    record.settings = "{}";
    record.inputs = {{"a.gltf", {}, 1}};
    record.scene = "a.gltf";
    const auto id = made->store_->submit(record);
    KILN_CHECK(id && *id == 1);
  }
  return made;
}

std::vector<KnownAnswer> SpoolResults::known(JobId job) {
  auto rows = store_->commits(job);
  KILN_CHECK(rows);
  std::vector<KnownAnswer> known;
  known.reserve(rows->size());
  for (const CommitRow& row : *rows)
    known.push_back({row.unit, row.shape, row.digest, row.worker, row.settled, row.verified});
  return known;
}

void SpoolResults::put(const StoreAnswer& a, std::shared_ptr<const UnitResult> result,
                       std::function<void()> stored) {
  store_->commit_result({a.job, a.unit, a.shape, a.digest, a.identity, false}, bytes_of_result(*result),
                        [stored = std::move(stored)](const Status& done) {
                          KILN_CHECK(done);
                          stored();
                        });
}

void SpoolResults::settle(const Settle& s) {
  store_->settle(s.job, s.unit, s.digest, s.verified, ignore);
}

void SpoolResults::revoke(const Revoke& r) {
  store_->revoke(r.job, {r.unit}, ignore);
}

Expected<std::shared_ptr<const UnitResult>> SpoolResults::read(JobId job, uint64_t unit,
                                                               const Digest& digest) {
  KILN_TRY(const Bytes bytes, store_->read_result(job, unit, digest));
  ByteReader r(bytes);
  auto result = std::make_shared<UnitResult>();
  result->unit = r.get<uint64_t>();
  result->site_count = r.get<uint32_t>();
  result->plane_count = r.get<uint32_t>();
  result->moments = r.get_array<double>();
  result->rays = r.get<uint64_t>();
  KILN_CHECK(r.at_end());
  return std::shared_ptr<const UnitResult>(std::move(result));
}

void fill_store(const std::filesystem::path& folder, JobId job, const std::vector<WorkUnit>& units,
                uint32_t planes) {
  const auto store = SpoolResults::open(folder);
  for (const WorkUnit& unit : units) {
    auto result = std::make_shared<UnitResult>();
    result->unit = unit.id;
    result->site_count = static_cast<uint32_t>(unit.sites.size());
    result->plane_count = planes;
    result->moments.assign(unit.sites.size() * planes, 0.0);
    const Digest digest = result_digest(*result);
    store->put({0, "peer", job, unit.id, unit_shape(unit), digest, 0}, result, [] {});
    store->settle({job, unit.id, digest, false, "peer"});
  }
  KILN_CHECK(store->store().flush());
}

}  // namespace kiln::bench

#include "common/job/unit.h"

#include <algorithm>
#include <functional>

namespace kiln {

const char* TransportSettings::fault() const {
  const std::vector<uint32_t>& list = quantities.responses;
  const bool ascending = std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()) == list.end();
  if (!ascending || (!list.empty() && list.back() >= response_roster().size()))
    return "the job asks for a quantity that does not exist in this release";
  if ((quantities.direct_apart || quantities.all_light || quantities.cache_draws) && !quantities.light)
    return "the job asks for parts of light without light";
  if (quantities.probes && (!quantities.light || quantities.direct_apart || quantities.all_light ||
                            quantities.cache_draws || !list.empty() || basis != find_basis("sh_l2")))
    return "the job asks for probes with what probes do not have";
  if (quantities.probe_visibility && !quantities.probes)
    return "the job asks for the visibility of probes without probes";
  if (list.empty() && !quantities.light) return "the job asks for no quantity at all";
  if (!(response.ao_distance > 0.0f)) return "the job's ambient occlusion has no valid distance";
  return nullptr;
}

Bytes write_job(const JobSpec& job) {
  return write_fields(job);
}
Expected<JobSpec> read_job(std::span<const std::byte> bytes) {
  return read_fields<JobSpec>(bytes, ErrorKind::kProtocol, "job description");
}

uint64_t unit_shape(const WorkUnit& unit) {
  FieldWriter w;
  WorkUnit::shape(unit, w);
  if (unit.take > 0) w(unit.take);
  return xxh3(w.take());
}

Bytes write_result(const UnitResult& result) {
  return write_fields(result);
}
Expected<UnitResult> read_result(std::span<const std::byte> bytes) {
  return read_fields<UnitResult>(bytes, ErrorKind::kInvalidInput, "stored result");
}

Digest result_digest(const UnitResult& result) {
  FieldDigest d;
  UnitResult::agreed(result, d);
  return d.finish();
}

}  // namespace kiln

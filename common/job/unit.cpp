#include "common/job/unit.h"

#include <algorithm>
#include <functional>

#include "common/base/format.h"

namespace kiln {
namespace {

// Bits of the byte that says which sums of light a job asks for.
constexpr uint8_t kLight = 1, kDirectApart = 2, kAllLight = 4;

void put_responses(const TransportSettings& t, ByteWriter& w) {
  const Quantities& q = t.quantities;
  w.put(static_cast<uint8_t>((q.light ? kLight : 0) | (q.direct_apart ? kDirectApart : 0) |
                             (q.all_light ? kAllLight : 0)));
  w.put_array(t.quantities.responses);
  w.put(t.response.ao_distance);
  w.put(static_cast<uint32_t>(t.response.ao_falloff));
}

Status get_responses(ByteReader& r, TransportSettings& t) {
  const auto light = r.get<uint8_t>();
  t.quantities.light = light & kLight;
  t.quantities.direct_apart = light & kDirectApart;
  t.quantities.all_light = light & kAllLight;
  t.quantities.responses = r.get_array<uint32_t>();
  t.response.ao_distance = r.get<float>();
  const auto falloff = r.get<uint32_t>();
  t.response.ao_falloff = static_cast<Falloff>(falloff);
  const std::vector<uint32_t>& list = t.quantities.responses;
  const bool ascending = std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()) == list.end();
  if (!ascending || (!list.empty() && list.back() >= response_roster().size()))
    return fail(ErrorKind::kProtocol, "the job asks for a quantity that does not exist in this release");
  if (light > (kLight | kDirectApart | kAllLight) || (light && !t.quantities.light))
    return fail(ErrorKind::kProtocol, "the job asks for sums of light that do not exist in this release");
  if (list.empty() && !t.quantities.light)
    return fail(ErrorKind::kProtocol, "the job asks for no quantity at all");
  if (!(t.response.ao_distance > 0.0f) || falloff >= kFalloffs)
    return fail(ErrorKind::kProtocol, "the job's ambient occlusion has no valid distance or falloff");
  return {};
}

}  // namespace

Bytes write_job(const JobSpec& job) {
  ByteWriter w;
  w.put(job.id);
  w.put(job.scene);
  w.put(job.atlas);
  w.put(job.transport.basis);
  w.put<uint8_t>(job.transport.direct);
  w.put<uint8_t>(job.transport.indirect);
  w.put(job.transport.max_bounces);
  w.put(job.transport.seed);
  w.put(static_cast<uint32_t>(job.transport.sampler));
  w.put<uint8_t>(job.transport.watertight);
  w.put_string(job.transport.isa);
  // Jobs that ask for light alone are the same bytes as before there was anything else.
  if (job.transport.quantities != Quantities{}) put_responses(job.transport, w);
  return w.take();
}

Expected<JobSpec> read_job(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  JobSpec job;
  job.id = r.get<uint64_t>();
  job.scene = r.get<Digest>();
  job.atlas = r.get<Digest>();
  job.transport.basis = r.get<uint32_t>();
  job.transport.direct = r.get<uint8_t>() != 0;
  job.transport.indirect = r.get<uint8_t>() != 0;
  job.transport.max_bounces = r.get<uint32_t>();
  job.transport.seed = r.get<uint64_t>();
  const auto sampler = r.get<uint32_t>();
  job.transport.sampler = static_cast<Sampler>(sampler);
  job.transport.watertight = r.get<uint8_t>() != 0;
  job.transport.isa = r.get_string();
  if (!r.at_end()) KILN_TRY_STATUS(get_responses(r, job.transport));
  if (!r.at_end()) return fail(ErrorKind::kProtocol, "a job description is damaged");
  if (sampler >= kSamplers)
    return fail(ErrorKind::kProtocol, text("sampler {} does not exist in this release", sampler));
  return job;
}

uint64_t unit_shape(const WorkUnit& unit) {
  ByteWriter w;
  w.put(unit.first_sample);
  w.put(unit.sample_count);
  w.put_array(unit.sites);
  w.put(unit.replicate);
  w.put(unit.cache);
  return xxh3(w.take());
}

Bytes write_result(const UnitResult& result) {
  ByteWriter w;
  w.put(result.unit);
  w.put(result.site_count);
  w.put(result.plane_count);
  w.put(result.rays);
  w.put(result.nonfinite);
  w.put(result.nonfinite_texel);
  w.put(result.nonfinite_sample);
  w.put(result.seconds);
  w.put_array(result.moments);
  return w.take();
}

Expected<UnitResult> read_result(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  UnitResult result;
  result.unit = r.get<uint64_t>();
  result.site_count = r.get<uint32_t>();
  result.plane_count = r.get<uint32_t>();
  result.rays = r.get<uint64_t>();
  result.nonfinite = r.get<uint64_t>();
  result.nonfinite_texel = r.get<uint32_t>();
  result.nonfinite_sample = r.get<uint32_t>();
  result.seconds = r.get<double>();
  result.moments = r.get_array<double>();
  if (!r.at_end() || result.moments.size() != uint64_t{result.site_count} * result.plane_count)
    return fail(ErrorKind::kInvalidInput, "a stored result is damaged");
  return result;
}

Digest result_digest(const UnitResult& result) {
  Sha256 h;
  const uint64_t head[] = {result.unit, result.site_count, result.plane_count, result.nonfinite};
  h.add(std::as_bytes(std::span(head)));
  h.add(bytes_of(result.moments));
  return h.finish();
}

}  // namespace kiln

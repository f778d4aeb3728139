#include "common/job/unit.h"

#include "common/base/format.h"

namespace kiln {

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

// Units of work (texels, sample range) and their results.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/fields.h"
#include "common/base/status.h"
#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "common/responses/quantities.h"

namespace kiln {

// How emissive triangles and the environment image are sampled: by light sampling and paths with MIS, or by
// one of the two. Other lights have one strategy, which always applies.
enum class MisMode { kBoth, kLights, kPaths };

template <>
struct EnumField<Sampler> {
  static constexpr const char* kName = "sampler";
  static constexpr uint8_t kCount = kSamplers;
};
template <>
struct EnumField<Falloff> {
  static constexpr const char* kName = "falloff";
  static constexpr uint8_t kCount = kFalloffs;
};

// Settings shared by every unit of a job; sent once. Everything that affects a byte of the result is here or
// in the unit.
struct TransportSettings {
  uint32_t basis = 1;  // index into basis_roster()
  Quantities quantities{};
  ResponseSettings response{};
  bool direct = true, indirect = true;
  uint32_t max_bounces = 64;
  uint64_t seed = 0;
  Sampler sampler = Sampler::kOwen;
  bool watertight = false;   // no ray slips between triangles that share an edge; slower
  std::string isa = "avx2";  // Embree's kernels: "sse2", "sse4.2", "avx", "avx2", "avx512"
  PrimaryDensity primary = PrimaryDensity::kMixed;  // not sent: tests/bench/convergence.cpp alone changes it
  MisMode mis_mode = MisMode::kBoth;                // not sent: tests/equivalence alone changes it
  static void fields(auto& t, auto& v) {
    v(t.basis, t.direct, t.indirect, t.max_bounces, t.seed, t.sampler, t.watertight, t.isa);
    v(t.quantities.light, t.quantities.direct_apart, t.quantities.all_light, t.quantities.responses);
    v(t.response.ao_distance, t.response.ao_falloff);
    v(t.quantities.probes, t.quantities.probe_visibility, t.quantities.cache_draws);
  }
  const char* fault() const;
};

struct JobSpec {
  uint64_t id = 0;
  Digest scene;  // structure chunk
  Digest atlas;  // atlas chunk; of a job whose quantities are probes, the chunk of their points
  TransportSettings transport;
  static void fields(auto& j, auto& v) { v(j.id, j.scene, j.atlas, j.transport); }
};

Bytes write_job(const JobSpec& job);
Expected<JobSpec> read_job(std::span<const std::byte> bytes);

// Independent halves of every texel's samples; their difference measures the error.
constexpr uint32_t kReplicates = 2;
// The seed of a unit's samples. Samples that are taken again, after those of a rough cache were dropped, are
// others: noise that is the same in cache after cache adds up.
constexpr uint64_t replicate_seed(uint64_t job_seed, uint32_t replicate, uint32_t take) {
  return sequence_seed(job_seed, replicate + uint64_t{kReplicates} * take);
}

// Sums over samples [first_sample, first_sample + sample_count) of each listed texel site. The result
// does not depend on how a pass is cut into units: every texel's sums stand alone.
struct WorkUnit {
  uint64_t id = 0;  // unique in the job
  uint32_t first_sample = 0, sample_count = 0;
  std::vector<uint32_t> sites{};  // indices into TexelSites
  uint32_t replicate = 0;         // below kReplicates; with `take` it selects the random sequence
  Digest cache{};                 // irradiance cache that paths end at (irradiance_cache.h); zero: none
  uint32_t take = 0;              // how often samples of these sites were dropped before
  static void fields(auto& u, auto& v) {
    v(u.id);
    shape(u, v);
    v(u.take);
  }
  // What unit_shape() hashes: all but the id; and the take unless it is 0, so that shapes are those of
  // releases that had none.
  static void shape(auto& u, auto& v) { v(u.first_sample, u.sample_count, u.sites, u.replicate, u.cache); }
  const char* fault() const { return replicate < kReplicates ? nullptr : "its replicate does not exist"; }
};

// Hash of everything but the id: a result of another shape belongs to another unit. Ids change their meaning
// when a job is rewound, or cut by another release.
uint64_t unit_shape(const WorkUnit& unit);

struct UnitResult {
  uint64_t unit = 0;
  uint32_t site_count = 0, plane_count = 0;
  std::vector<double> moments;                         // [site][plane], planes of MomentLayout
  uint64_t rays = 0;                                   // all rays traced
  uint64_t nonfinite = 0;                              // samples with a contribution dropped: not finite
  uint32_t nonfinite_texel = 0, nonfinite_sample = 0;  // the first such sample, for replay
  double seconds = 0;                                  // of one thread; for the report only
  static void fields(auto& r, auto& v) {
    v(r.unit, r.site_count, r.plane_count, r.rays, r.nonfinite, r.nonfinite_texel, r.nonfinite_sample,
      r.seconds, r.moments);
  }
  // What result_digest() hashes: all that must agree when a unit is computed twice.
  static void agreed(auto& r, auto& v) { v(r.unit, r.site_count, r.plane_count, r.nonfinite, r.moments); }
  const char* fault() const {
    return moments.size() == uint64_t{site_count} * plane_count
               ? nullptr
               : "its moments are not those of its sites and planes";
  }
};

// Serialises a whole result for storage; reading checks sizes.
Bytes write_result(const UnitResult& result);
Expected<UnitResult> read_result(std::span<const std::byte> bytes);

// SHA-256 of everything that must agree when a unit is computed twice: ids, shape and moments, not times.
Digest result_digest(const UnitResult& result);

}  // namespace kiln
